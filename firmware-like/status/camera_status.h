// Status of one camera: its zoom and lens, the calibration board, the measured tip, tracked bodies.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>

#include "firmware-like/geometry/pose.h"
#include "firmware-like/lens/board_prompt.h"
#include "firmware-like/lens/zoom_supervisor.h"

namespace plumbline::status {

/// Viewing position of a camera; identifies it among the cell's cameras.
enum class CameraName : std::uint8_t { kNone, kSide, kRear, kFront, kTop };
inline constexpr std::array<const char*, 5> kCameraNames = {"", "side", "rear", "front", "top"};
inline const char* CameraNameText(CameraName name) {
  return kCameraNames[static_cast<std::size_t>(name)];
}

/// Status of one camera, written by its worker and read by registers, pages and displays. Times are
/// monotonic [s]; kNever if the event has not occurred.
struct CameraStatus {
  static constexpr std::size_t kMaxBodies = 6, kMaxContradictingTags = 8;
  static constexpr double kNever = -std::numeric_limits<double>::infinity();
  struct Body {
    bool valid = false, ambiguous = false;
    Pose X_WK;            ///< pose of the body in the measurement frame
    double radius_m = 0;  ///< 95 % radius of its origin
    double time_s = kNever;
  };

  bool configured = false;
  CameraName name = CameraName::kNone;
  lens::ZoomState state = lens::ZoomState::kUnknown;
  lens::ZoomReason reason = lens::ZoomReason::kNoReading;
  bool lens_stale = false;            ///< measurements of this camera must not be used
  bool camera_lost = false;           ///< no frames arrive
  bool zoom_unknown = false;          ///< the zoom sensor does not respond
  bool board_wanted = false;          ///< the operator is asked to show the calibration board
  bool fiducials_hidden = false;      ///< the reference tags are not visible
  bool fiducial_moved = false;        ///< a reference tag is not where it was declared; see the log
  bool store_fault = false;           ///< lenses cannot be stored; see the log
  bool rests_on_no_window = false;    ///< the lens in use rests on no_window of [camera]
  bool rests_on_fixed_focus = false;  ///< the same for fixed_focus
  bool opencv_prints = false;  ///< tags are read as OpenCV draws them; the file does not say so
  /// Ids of reference tags that contradict the others, or each other; the first ones if there are
  /// more.
  std::array<std::int32_t, kMaxContradictingTags> contradicting_tags{};
  std::size_t contradicting_count = 0;
  lens::BoardPrompt prompt = lens::BoardPrompt::kNone;
  std::uint16_t board_views = 0;  ///< board views accepted in this capture
  std::optional<std::int32_t> zoom_counts, focus_counts;
  std::uint32_t lens_id = 0;  ///< id in the lens store; 0 without a lens, or if not stored
  /// Radius of the circle around the middle of the image within which the lens in use is trusted
  /// [px]; infinite for the whole image, nullopt if no lens is in use.
  std::optional<double> usable_radius_px;
  double zoom_time_s = kNever, frame_time_s = kNever;
  bool tip_valid = false;  ///< the lens is valid and the tool was at standstill
  Vec3 tip_W = Vec3::Zero();
  Mat3 tip_covariance_W = Mat3::Zero();      ///< due to image noise and the lens [m^2]
  Mat3 tip_tag_covariance_W = Mat3::Zero();  ///< due to errors in the declared tag positions [m^2]
  double tip_time_s = kNever;
  std::size_t bodies_configured = 0;
  std::array<Body, kMaxBodies> bodies;  ///< in the order of the tag file
};

}  // namespace plumbline::status
