// Status of one camera: its zoom and lens, the calibration board, the measured tip, tracked bodies.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>

#include "firmware-like/geometry/pose.h"
#include "firmware-like/lens/board_prompt.h"
#include "firmware-like/lens/zoom_supervision.h"

namespace plumbline {

/// Where a camera looks from; distinguishes one camera from another.
enum class CameraName : std::uint8_t { kNone, kSide, kRear, kFront, kTop };
inline constexpr std::array<const char*, 5> kCameraNames = {"", "side", "rear", "front", "top"};
inline const char* CameraNameText(CameraName name) {
  return kCameraNames[static_cast<std::size_t>(name)];
}

/// Times are monotonic; kNever where there was no such event.
struct CameraStatus {
  static constexpr std::size_t kMostBodies = 6;
  static constexpr double kNever = -std::numeric_limits<double>::infinity();
  struct Body {
    bool valid = false, ambiguous = false;
    Pose X_WK;            ///< in the measurement frame
    double radius_m = 0;  ///< that holds 95 % of its origin
    double time_s = kNever;
  };

  bool configured = false;
  CameraName name = CameraName::kNone;
  ZoomState state = ZoomState::kUnknown;
  ZoomReason reason = ZoomReason::kNothingHeard;
  bool lens_stale = false;        ///< nothing that this camera measures may be used
  bool camera_lost = false;       ///< no frames arrive
  bool zoom_unknown = false;      ///< the zoom sensor does not answer
  bool board_wanted = false;      ///< a person is asked to show the calibration board
  bool fiducials_hidden = false;  ///< the reference tags are not visible
  bool fiducial_moved = false;    ///< a reference tag is not where it was declared; see the log
  bool store_fault = false;       ///< lenses cannot be stored; see the log
  BoardPrompt prompt = BoardPrompt::kNone;
  std::uint16_t board_views = 0;  ///< kept in this capture
  std::optional<std::int32_t> zoom_counts, focus_counts;
  std::uint32_t lens_id = 0;  ///< in the lens store; 0: none, or not stored
  double zoom_time_s = kNever, frame_time_s = kNever;
  bool tip_valid = false;  ///< the lens is valid and the tool was at standstill
  Vec3 tip_W = Vec3::Zero();
  Mat3 tip_covariance_W = Mat3::Zero();  ///< from image noise and the lens [m^2]
  Mat3 tip_places_W = Mat3::Zero();      ///< from errors in the tags' declared places [m^2]
  double tip_time_s = kNever;
  std::size_t bodies_configured = 0;
  std::array<Body, kMostBodies> bodies;  ///< in the order of the tags' file
};

}  // namespace plumbline
