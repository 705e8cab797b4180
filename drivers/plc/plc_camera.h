// What the camera's side tells the PLC.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>

#include "firmware-like/geometry/pose.h"
#include "firmware-like/lens/board_prompt.h"
#include "firmware-like/lens/zoom_supervision.h"

namespace plumbline {

/// Bits of register 502.
namespace camera_bits {
inline constexpr std::uint16_t kLensStale = 1 << 0;    ///< nothing measured by camera is to be used
inline constexpr std::uint16_t kCameraLost = 1 << 1;   ///< no frames come
inline constexpr std::uint16_t kSensorLost = 1 << 2;   ///< the zoom is not known
inline constexpr std::uint16_t kBoardWanted = 1 << 3;  ///< a person is asked for the board
inline constexpr std::uint16_t kMarksHidden = 1 << 4;
inline constexpr std::uint16_t kMarkMoved = 1 << 5;   ///< a mark stands elsewhere; see the log
inline constexpr std::uint16_t kStoreFault = 1 << 6;  ///< lenses cannot be kept; see the log
}  // namespace camera_bits

/// From where a camera looks: what tells two of them apart.
enum class CameraName : std::uint8_t { kNone, kSide, kRear, kFront, kTop };
inline constexpr std::array<const char*, 5> kCameraNames = {"", "side", "rear", "front", "top"};
inline const char* CameraNameText(CameraName name) {
  return kCameraNames[static_cast<std::size_t>(name)];
}

/// Times are monotonic; never where infinite and negative.
struct PlcCamera {
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
  std::uint16_t bits = 0;  ///< camera_bits
  BoardPrompt prompt = BoardPrompt::kNone;
  std::uint16_t board_views = 0;  ///< kept in this capture
  std::optional<std::int32_t> zoom_counts, focus_counts;
  std::uint32_t lens_id = 0;  ///< of the store; 0: none, or not kept
  double zoom_time_s = kNever, frame_time_s = kNever;
  bool tip_valid = false;  ///< the lens is valid and the tool stood still
  Vec3 tip_W = Vec3::Zero();
  Mat3 tip_covariance_W = Mat3::Zero();  ///< by the image's noise and the lens [m^2]
  Mat3 tip_places_W = Mat3::Zero();      ///< by errors of the tags' declared places [m^2]
  double tip_time_s = kNever;
  std::size_t bodies_configured = 0;
  std::array<Body, kMostBodies> bodies;  ///< in the order of the tags' file
};

}  // namespace plumbline
