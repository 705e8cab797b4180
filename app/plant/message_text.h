// JSON payloads of the messages: mm, degrees and kg, as in measured.csv; times in milliseconds of
// UTC since 1970; unknown values are null.
#pragma once

#include <string>
#include <vector>

#include "app/cell/view_link/view_state.h"
#include "app/plant/message.h"
#include "app/plant/probe_tail.h"
#include "app/plant/queue.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::plant {

/// Incremented with every change that an older consumer would misinterpret.
inline constexpr int kFleetSchema = 1;
/// The first level of every topic.
inline constexpr const char* kFleetNamespace = "plumblineV1";

/// Constants of the cell, from the configuration.
struct FleetCell {
  std::string group, node, cell;
  std::vector<model::Joint> joints;
  struct Point {
    int id = 0;
    std::string name;
  };
  std::vector<Point> points;
};

std::string TopicOf(const FleetCell& cell, const char* type);

/// @param bdSeq  number of the connection: the UTC time of the attempt [ms]
std::string BirthText(const FleetCell& cell, const FleetQueue& queue, std::int64_t bdSeq,
                      std::int64_t utc_ms);
/// Also the payload of the last will; its time is then that of the connection.
std::string DeathText(std::int64_t bdSeq, std::int64_t utc_ms, bool clean_shutdown);
/// The body, preceded by stream, seq and timestamp.
std::string MessageText(const std::string& stream, const QueuedMessage& queued);

std::string StateBody(const cell::ViewState& state, const FleetCell& cell);
std::string PointBody(const cell::ViewPoint& point, const FleetCell& cell, int model_version);
std::string LensBody(const status::CameraStatus& status);
std::string ModelBody(const cell::ViewState& state, int before);
std::string ProbeBody(const ProbeRow& probe);
/// @param word  "alarms" or "warnings", as in config/register-map.md, or "fleet"
std::string AlarmBody(const char* word, int bit, const std::string& meaning, bool begins);
std::string LostBody(const FleetQueue::Dropped& dropped);

}  // namespace plumbline::plant
