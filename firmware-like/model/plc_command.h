// Decoded PLC command.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "firmware-like/geometry/pose.h"

namespace plumbline::model {

/// Largest number of cameras used at the same time.
inline constexpr std::size_t kMaxCameras = 2;

enum class PlcCommandCode : std::uint16_t {
  kNone = 0,
  kCorrectPoint = 1,       ///< correct the configured point with this id
  kCorrectPose = 2,        ///< correct the pose in the command, given as floats
  kCorrectPoseScaled = 3,  ///< the same, given as int16 in 0.1 mm and mrad (rotation vector)
  kPredictLanding = 4,     ///< predict where the loaded tool point lands if the pose is commanded
  kAcknowledge = 5,        ///< the result was read; release it
  kProbe = 6,              ///< record the measured tip together with the model's prediction
  kProbeFine = 7,          ///< the same, given as int32 in 0.001 mm
  kRestartMonitor = 8,     ///< clear the drift alarm and collect a new reference
  kStartCalibration = 9,   ///< start lens calibration: the board is being shown
  kCancelCalibration = 10,
  kProbeByCamera = 11,  ///< as kProbe, with the tip measured by the cameras
  kProbeTouch = 12,     ///< record that the tip is on an artefact: point, sphere or plane
  kProbeReading = 13,   ///< record the reading of a dial gauge, or the distance from a point
};

/// One command; it is executed once when its sequence number changes.
struct PlcCommand {
  std::uint16_t sequence = 0;
  PlcCommandCode code = PlcCommandCode::kNone;
  std::uint16_t point_id = 0;  ///< for kProbeTouch and kProbeReading: artefact, from 1
  /// For kStartCalibration, kCancelCalibration and kProbeByCamera: camera number from 1; 0 if not
  /// specified, see Machine.
  std::uint16_t camera = 0;
  bool pose_valid = false;           ///< every number of the pose is finite
  Pose X_BP;                         ///< for kCorrectPose*, kPredictLanding: tool point in B
  std::optional<Vec3> probe_W;       ///< for kProbe*: measured tip in W [m]; absent if not finite
  std::optional<double> reading_m;   ///< for kProbeReading; absent if not finite
  std::optional<double> payload_kg;  ///< overrides the payload carried by the robot
  bool acknowledge = false;          ///< a rising edge releases the result, like kAcknowledge
  std::uint16_t heartbeat = 0;       ///< any change shows that the PLC is running
  bool manual = false;               ///< the PLC reports manual operation
  bool motion_enabled = false;       ///< the PLC allows corrections inside the motion
};

}  // namespace plumbline::model
