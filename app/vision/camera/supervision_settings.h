// Settings of a camera's supervision, from the configuration.
#pragma once

#include <string>
#include <vector>

#include "app/base/config/camera_config.h"
#include "app/vision/camera/board_session.h"
#include "app/vision/camera/tag_check.h"
#include "app/vision/tracking/tracker.h"
#include "firmware-like/lens/zoom_supervisor.h"
#include "firmware-like/status/camera_status.h"

namespace plumbline::vision {

struct LensSupervisorSettings {
  status::CameraName name = status::CameraName::kNone;
  lens::ZoomSupervisorSettings zoom;
  TagCheckSettings tag_check;
  double acceptable_px = 0.5;       ///< largest acceptable projection uncertainty (1 sd)
  target::Body cell;                ///< the reference tags
  std::string family;               ///< of all tags
  bool opencv_turns = false;        ///< OpenCV draws that family rotated by half a turn
  Pose X_WK;                        ///< the cell's body in the measurement frame
  std::string tool;                 ///< name of the body that carries the tip; empty: none
  Vec3 tip_T = Vec3::Zero();        ///< on that body [m]
  std::vector<std::string> bodies;  ///< bodies that are reported, in this order
};

LensSupervisorSettings LensSupervisorSettingsFrom(const config::CameraConfig& camera,
                                                  const config::VisionConfig& vision);

BoardSettings BoardSettingsFrom(const config::BoardConfig& config,
                                const target::DeclaredFacts& declared);

}  // namespace plumbline::vision
