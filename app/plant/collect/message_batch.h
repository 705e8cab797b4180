// A batch of messages, decoded, that one transaction writes.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "app/plant/broker/subscriber.h"
#include "app/plant/collect/message_decoder.h"
#include "app/plant/collect/stream_ledger.h"

namespace plumbline::plant {

using StreamKey = std::pair<int, std::int64_t>;  ///< cell and stream
inline constexpr std::int64_t kDay_ms = 86'400'000;

struct DecodedMessage {
  const Received* received = nullptr;
  int cell = 0;
  PlantMessage message;
  std::string reason;    ///< not empty: a dead letter
  bool refused = false;  ///< counted, and written nowhere
  bool repeated = false;
};

struct MessageBatch {
  std::span<DecodedMessage*> messages;
  std::vector<const DecodedMessage*> fresh;  ///< with a key, that had not arrived before
  std::map<StreamKey, StreamLedger> before, after;
  std::set<std::int64_t> months;  ///< whose partitions this transaction creates
  std::int64_t repeated = 0, letters = 0;
};

/// `2026-11-30 09:41:42.123+00`.
std::string UtcText(std::int64_t utc_ms);

}  // namespace plumbline::plant
