// What the robot controller said of itself, in SI, with what is known marked as known.
#pragma once

#include <cstdint>
#include <optional>

#include "firmware-like/model/cell_model.h"

namespace plumbline {

enum class RobotMode : std::uint8_t {
  kUnknown,
  kNotReady,
  kRunning,
  kManual,
  kStopped,
  kEmergencyStop
};

/// One reading of the controller. A value that the controller does not offer is absent; a value
/// that it offers and that makes no sense (NaN, out of limits) is present and judged by the
/// machine.
struct RobotState {
  double timestamp_s = 0;      ///< monotonic, when the last answer of this reading arrived
  std::uint64_t sequence = 0;  ///< counts readings; unchanged means nothing new was read
  JointVector q;               ///< [rad] or [m], as the controller counts them
  double q_resolution = 0;     ///< step of a register of q [rad]; 0: finer than matters
  std::optional<Pose> X_BT;    ///< tool pose in B as the controller reports it
  bool tcp_is_flange = false;  ///< the reported pose is that of the flange, without tool
  std::optional<Pose> X_FT;    ///< tool offset that the controller reports to use
  std::optional<double> payload_kg;
  std::optional<Vec3> payload_cog_F;  ///< [m]
  std::optional<double> temp_C;
  std::optional<int> tool_number;
  RobotMode mode = RobotMode::kUnknown;
};

}  // namespace plumbline
