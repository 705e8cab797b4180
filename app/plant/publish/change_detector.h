// Messages for the broker, derived from the daemon's states: periodic ones, and one for each
// change.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "app/base/config/mqtt_config.h"
#include "app/cell/view_link/view_state.h"
#include "app/plant/publish/message_text.h"
#include "drivers/plc/register_map.h"

namespace plumbline::plant {

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
