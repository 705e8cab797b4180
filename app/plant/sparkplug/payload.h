// Sparkplug B payloads as bytes: births, data and deaths of an edge node, and a host's commands.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/plant/sparkplug/metric_store.h"
#include "firmware-like/result.h"

namespace plumbline::plant {

/// All metrics with name, alias, type and value, preceded by bdSeq and Node Control/Rebirth.
/// @param now_ms  UTC, also the time of metrics that were never reported
std::string NodeBirth(const MetricStore& store, int bdSeq, int seq, std::int64_t now_ms);
/// Takes the changed metrics, by alias only.
std::string NodeData(MetricStore& store, int seq, std::int64_t now_ms);
/// Also the will.
std::string NodeDeath(int bdSeq, std::int64_t now_ms);

inline constexpr std::size_t kMaxCommand_bytes = 65536;
struct Command {
  bool rebirth = false;
  std::vector<std::string> ignored;  ///< names of other metrics, at most 8, for the log
};
/// Decodes an NCMD.
Result<Command> CommandFromPayload(std::string_view payload);

struct HostState {
  bool online = false;
  std::int64_t utc_ms = 0;
};
/// Decodes the payload of a STATE topic; nullopt if it is not one of Sparkplug 3.0.
std::optional<HostState> HostStateFromText(std::string_view text);

}  // namespace plumbline::plant
