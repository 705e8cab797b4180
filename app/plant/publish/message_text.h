// Text of the messages for the broker: topics and JSON payloads.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "app/cell/view_link/view_state.h"
#include "app/plant/publish/cell_in_force.h"
#include "app/plant/publish/message.h"
#include "app/plant/publish/probe_tail.h"
#include "app/plant/publish/queue.h"
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
  model::ArmIdentity arm{};
  std::string page{};  ///< address of the cell's own page; empty if other computers reach none
};

/// The longest NCELL message, and the longest of all others: a broker and a collector can limit
/// what they accept.
inline constexpr std::size_t kLongestCell_bytes = 256'000, kLongestMessage_bytes = 64'000;

std::string TopicOf(const FleetCell& cell, const char* type);

/// The points are left out if the text would become too long, with their number.
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
/// The numbers of a probe have the decimals of an exported measured.csv.
std::string ProbeBody(const ProbeRow& probe, const std::vector<model::Joint>& joints);
/// The text of the cell is left out if the message would become too long, with a note.
std::string CellBody(const FleetCell& cell, const CellInForce& in_force);
/// @param word  "alarms" or "warnings", as in docs/reference/registers.md, or "fleet"
std::string AlarmBody(const char* word, int bit, const std::string& meaning, bool begins);
std::string LostBody(const FleetQueue::Dropped& dropped);

}  // namespace plumbline::plant
