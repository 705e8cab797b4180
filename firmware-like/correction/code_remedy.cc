#include "firmware-like/correction/code_remedy.h"

namespace plumbline::correction {

const char* RemedyOf(CorrectionCode code) {
  switch (code) {
    case CorrectionCode::kOk:
      return "";
    case CorrectionCode::kUnreachable:
      return "check the point, its frame and the robot's base";
    case CorrectionCode::kJointLimit:
      return "move the station, or check min_deg and max_deg";
    case CorrectionCode::kSingular:
      return "tilt the tool a little, or move the station";
    case CorrectionCode::kTooLarge:
      return "check payload, masses and compliances";
    case CorrectionCode::kNotConverged:
      return "look for a compliance or a mass that is far too large";
    case CorrectionCode::kTorquesUnknown:
      return "declare link_mass_kg of every link";
    case CorrectionCode::kPayloadUnknown:
      return "set [payload] of plumbline.toml and cog_mm of the cell";
    case CorrectionCode::kNoRobot:
      return "check the robot and its cable";
    case CorrectionCode::kPending:
      return "wait until it has been computed";
    case CorrectionCode::kNoCamera:
      return "configure a [[camera]], or correct the number in register 1016";
    case CorrectionCode::kLensStale:
      return "keep the zoom at rest and the reference tags in view";
    case CorrectionCode::kUnknownPoint:
    case CorrectionCode::kBadCommand:
      return "correct the PLC's command";
    case CorrectionCode::kTipNotSeen:
      return "stop the robot and clear the camera's view of the tool";
    case CorrectionCode::kCamerasDisagree:
      return "check the reference tags and the lens of each camera";
    case CorrectionCode::kNotRecorded:
      return "set enabled = true in [monitoring]";
    case CorrectionCode::kProbeImplausible:
      return "send the measured tip in mm";
    case CorrectionCode::kRobotMoving:
      return "send the probe while the robot is at standstill";
    case CorrectionCode::kStorageUnavailable:
      return "free disk space, or check the permissions of the state directory";
    case CorrectionCode::kProbeQuarantined:
      return "run plumbline journal quarantine list";
  }
  return "";
}

}  // namespace plumbline::correction
