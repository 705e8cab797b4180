// What a PLC asks for, decoded.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "firmware-like/geometry/pose.h"

namespace plumbline {

/// How many cameras may look at once.
inline constexpr std::size_t kMostCameras = 2;

enum class PlcCommandCode : std::uint16_t {
  kNone = 0,
  kCorrectPoint = 1,       ///< the configured point of that id
  kCorrectPose = 2,        ///< the pose in the command, as floats
  kCorrectPoseScaled = 3,  ///< likewise as int16 0.1 mm and mrad (rotation vector)
  kPredictLanding = 4,     ///< where the loaded tool point lands if the pose is commanded as it is
  kAcknowledge = 5,        ///< the result was read; free it
  kProbe = 6,              ///< the tip was measured there: record it, with what the model predicts
  kProbeFine = 7,          ///< likewise as int32 0.001 mm
  kRestartMonitor = 8,     ///< forget the drift alarm; begin with a new reference
  kStartCalibration = 9,   ///< of the camera's lens: the board is being shown
  kCancelCalibration = 10,
  kProbeByCamera = 11,  ///< as kProbe, the tip as the camera sees it now
};

/// One command; a new sequence number executes it, once.
struct PlcCommand {
  std::uint16_t sequence = 0;
  PlcCommandCode code = PlcCommandCode::kNone;
  std::uint16_t point_id = 0;
  /// Of kStartCalibration, kCancelCalibration, kProbeByCamera: 1 the first; 0: see the machine.
  std::uint16_t camera = 0;
  bool pose_valid = false;           ///< every number of the pose is finite
  Pose X_BP;                         ///< of kCorrectPose*, kPredictLanding: tool point in B
  std::optional<Vec3> probe_W;       ///< of kProbe*: measured tip in W; absent where not finite
  std::optional<double> payload_kg;  ///< to be used instead of what the robot carries
  bool acknowledge = false;          ///< its rising edge frees the result, as kAcknowledge does
  std::uint16_t heartbeat = 0;       ///< any change says that the PLC lives
  bool manual = false;               ///< the PLC says: operated by hand
};

}  // namespace plumbline
