// Robot state reported by the controller, in SI units.
#pragma once

#include <cstdint>
#include <optional>

#include "firmware-like/model/cell_model.h"

namespace plumbline::model {

enum class RobotMode : std::uint8_t {
  kUnknown,
  kNotReady,
  kRunning,
  kManual,
  kStopped,
  kEmergencyStop
};

/// One reading of the controller. Values that the controller does not provide are absent. Values
/// that it provides but that are implausible (NaN, out of limits) are present, and
/// PlausibilityFilter rejects them.
struct RobotState {
  double timestamp_s = 0;  ///< monotonic time before the first request: nothing was read earlier
  /// Counts readings; 0 before the first, unchanged if there is no new reading.
  std::uint64_t sequence = 0;
  JointVector q;               ///< joint positions [rad] or [m]
  double q_resolution = 0;     ///< resolution of the joint registers [rad]; 0: negligible
  std::optional<Pose> X_BT;    ///< reported tool pose in B
  bool tcp_is_flange = false;  ///< the reported pose is that of the flange, without tool
  std::optional<Pose> X_FT;    ///< tool offset used by the controller
  std::optional<double> payload_kg;
  std::optional<Vec3> payload_cog_F;  ///< [m]
  std::optional<double> temp_C;
  std::optional<int> tool_number;
  std::optional<int> payload_item;  ///< number of the payload item; 0: none
  RobotMode mode = RobotMode::kUnknown;
};

}  // namespace plumbline::model
