// Messages for the broker, derived from the daemon's states: periodic ones, and one for each
// change.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "app/base/config/mqtt_config.h"
#include "app/cell/view_link/view_state.h"
#include "app/plant/publish/message.h"
#include "app/plant/publish/probe_tail.h"
#include "app/plant/publish/queue.h"
#include "drivers/plc/register_map.h"
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
/// @param word  "alarms" or "warnings", as in docs/reference/registers.md, or "fleet"
std::string AlarmBody(const char* word, int bit, const std::string& meaning, bool begins);
std::string LostBody(const FleetQueue::Dropped& dropped);

/// Compares each state with what was reported before. Pure: time is an input. Alarms, model and
/// lens states must be reported exactly once across restarts; Memory() returns what was reported,
/// to be stored together with the messages.
class ChangeDetector {
 public:
  /// An alarm counts as ended once it has been clear for this long, so that a flickering alarm is
  /// reported once.
  static constexpr double kAlarmOff_s = 1;
  /// If no state arrives for this long, the daemon counts as silent, which raises an alarm of its
  /// own.
  static constexpr double kSilent_s = 5;

  /// @param memory  Memory() of the previous run; ignored if empty or of another schema
  ChangeDetector(const config::MqttConfig& config, FleetCell cell, const std::string& memory);

  /// @param now_s  monotonic clock of this computer
  std::vector<Message> Update(const cell::ViewState& state, double now_s);
  /// To be called when no state has arrived. @param utc_s  now
  std::vector<Message> UpdateWithoutState(double now_s, double utc_s);

  std::string Memory() const;

 private:
  static constexpr int kNotReported = -1;
  struct TimedBit {
    double seen_s = -1e300, seen_utc_s = 0;  ///< when it was last set
  };
  struct ReportedPoint {
    cell::ViewPoint point;
    double at_s = -1e300;
  };
  void UpdateWord(const char* word, std::uint16_t bits, std::span<const plc::BitMeaning> meanings,
                  std::uint16_t& reported, std::map<std::uint16_t, TimedBit>& timed,
                  const cell::ViewState& state, double now_s, std::vector<Message>& messages);
  void UpdateLenses(const cell::ViewState& state, std::vector<Message>& messages);
  void UpdatePoints(const cell::ViewState& state, double now_s, std::vector<Message>& messages);
  void UpdateState(const cell::ViewState& state, double now_s, std::vector<Message>& messages);

  const config::MqttConfig config_;
  const FleetCell cell_;
  std::uint16_t alarms_ = 0, warnings_ = 0;  ///< as reported
  std::map<std::uint16_t, TimedBit> alarm_times_, warning_times_;
  bool silent_ = false;
  int model_version_ = kNotReported;
  std::vector<int> lenses_;     ///< reported lens state of each camera
  double received_s_ = -1e300;  ///< time of the last state
  std::map<int, ReportedPoint> points_;
  double state_s_ = -1e300;
  std::vector<int> summary_;  ///< a change of these values triggers a state message
};

}  // namespace plumbline::plant
