// What of the daemon's states is worth telling: a state now and then, and what changes.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "app/config/mqtt_config.h"
#include "app/fleet/message_text.h"
#include "drivers/plc/register_map.h"

namespace plumbline {

/// Compares each state with what was told. Pure: times are given. What must not be told twice or
/// forgotten when the process is restarted (alarms, model, lens) is its memory, to be kept with the
/// messages.
class Changes {
 public:
  /// An alarm has ended when it was away for so long: one that flickers is told once.
  static constexpr double kAlarmOff_s = 1;
  /// Without a state for so long the daemon is silent, which is an alarm of its own.
  static constexpr double kSilent_s = 5;

  /// @param memory  of a former run; empty or of another version: there was none
  Changes(const MqttConfig& config, FleetCell cell, const std::string& memory);

  /// @param now_s  monotonic, of this computer
  std::vector<Message> Take(const ViewState& state, double now_s);
  /// No state came. @param utc_s  now
  std::vector<Message> Wait(double now_s, double utc_s);

  std::string Memory() const;

 private:
  static constexpr int kNothingTold = -1;
  struct TimedBit {
    double seen_s = -1e300, seen_utc_s = 0;  ///< when it was set last
  };
  struct ToldPoint {
    ViewPoint point;
    double at_s = -1e300;
  };
  void TakeWord(const char* word, std::uint16_t bits, std::span<const BitMeaning> meanings,
                std::uint16_t& told, std::map<std::uint16_t, TimedBit>& timed,
                const ViewState& state, double now_s, std::vector<Message>& messages);
  void TakeLenses(const ViewState& state, std::vector<Message>& messages);
  void TakePoints(const ViewState& state, double now_s, std::vector<Message>& messages);
  void TakeState(const ViewState& state, double now_s, std::vector<Message>& messages);

  const MqttConfig config_;
  const FleetCell cell_;
  std::uint16_t alarms_ = 0, warnings_ = 0;  ///< told
  std::map<std::uint16_t, TimedBit> alarm_times_, warning_times_;
  bool silent_ = false;
  int model_version_ = kNothingTold;
  std::vector<int> lenses_;  ///< state of each camera's
  double heard_s_ = -1e300;  ///< of the last state
  std::map<int, ToldPoint> points_;
  double state_s_ = -1e300;
  std::vector<int> summary_;  ///< what makes a state worth telling out of turn
};

}  // namespace plumbline
