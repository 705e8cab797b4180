// The payloads as JSON: mm, degrees and kg, as in measured.csv; times in milliseconds of UTC since
// 1970. Values that are not known are null.
#pragma once

#include <string>
#include <vector>

#include "app/fleet/message.h"
#include "app/fleet/probe_tail.h"
#include "app/fleet/queue.h"
#include "app/view_link/view_state.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline {

/// Raised where a reader of the former payloads would misunderstand them.
inline constexpr int kFleetSchema = 1;
/// The first level of every topic.
inline constexpr const char* kFleetNamespace = "plumblineV1";

/// What stays the same from one message to the next: of the configuration.
struct FleetCell {
  std::string group, node, cell;
  std::vector<Joint> joints;
  struct Point {
    int id = 0;
    std::string name;
  };
  std::vector<Point> points;
};

std::string TopicOf(const FleetCell& cell, const char* type);

/// @param bdSeq  number of the connection: the moment when it was tried [ms]
std::string BirthText(const FleetCell& cell, const FleetQueue& queue, std::int64_t bdSeq,
                      std::int64_t utc_ms);
/// Of the last will too, which the broker tells: its time is that of the connection.
std::string DeathText(std::int64_t bdSeq, std::int64_t utc_ms, bool told_goodbye);
/// The body with stream, seq and timestamp before it.
std::string MessageText(const std::string& stream, const QueuedMessage& queued);

std::string StateBody(const ViewState& state, const FleetCell& cell);
std::string PointBody(const ViewPoint& point, const FleetCell& cell, int model_version);
std::string LensBody(const CameraStatus& status);
std::string ModelBody(const ViewState& state, int before);
std::string ProbeBody(const ProbeRow& probe);
/// @param word  "alarms" or "warnings", as in config/register-map.md, or "fleet"
std::string AlarmBody(const char* word, int bit, const std::string& meaning, bool begins);
std::string LostBody(const FleetQueue::Dropped& dropped);

}  // namespace plumbline
