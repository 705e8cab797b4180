// Prompt to the operator who holds the calibration board.
#pragma once

#include <cstdint>
#include <string_view>

namespace plumbline::lens {

/// The numbers are those of the register map and must not change. Left, right, upper and lower
/// refer to the image.
enum class BoardPrompt : std::uint8_t {
  kNone = 0,       ///< no capture is running
  kShowBoard = 1,  ///< show the whole board upright
  kHoldStill = 2,  ///< the board moves, or the image is blurred
  kTiltLeft = 3,   ///< tilt the left edge towards the camera
  kTiltRight = 4,
  kTiltUpper = 5,
  kTiltLower = 6,
  kUpperLeft = 7,  ///< move the board in that direction of the image
  kUpperRight = 8,
  kLowerLeft = 9,
  kLowerRight = 10,
  kCloser = 11,
  kFarther = 12,
  kLeft = 13,
  kRight = 14,
  kUp = 15,
  kDown = 16,
  kClockwise = 17,  ///< turn the board in its plane
  kCounterclockwise = 18,
};
inline constexpr int kBoardPrompts = 19;

/// Text for a display or a log line; empty for kNone.
constexpr std::string_view BoardPromptText(BoardPrompt prompt) {
  switch (prompt) {
    case BoardPrompt::kNone:
      return "";
    case BoardPrompt::kShowBoard:
      return "show the whole board";
    case BoardPrompt::kHoldStill:
      return "hold still";
    case BoardPrompt::kTiltLeft:
      return "tilt the left edge towards the camera";
    case BoardPrompt::kTiltRight:
      return "tilt the right edge towards the camera";
    case BoardPrompt::kTiltUpper:
      return "tilt the upper edge towards the camera";
    case BoardPrompt::kTiltLower:
      return "tilt the lower edge towards the camera";
    case BoardPrompt::kUpperLeft:
      return "move the board up and to the left";
    case BoardPrompt::kUpperRight:
      return "move the board up and to the right";
    case BoardPrompt::kLowerLeft:
      return "move the board down and to the left";
    case BoardPrompt::kLowerRight:
      return "move the board down and to the right";
    case BoardPrompt::kCloser:
      return "move the board closer";
    case BoardPrompt::kFarther:
      return "move the board farther away";
    case BoardPrompt::kLeft:
      return "move the board to the left";
    case BoardPrompt::kRight:
      return "move the board to the right";
    case BoardPrompt::kUp:
      return "move the board up";
    case BoardPrompt::kDown:
      return "move the board down";
    case BoardPrompt::kClockwise:
      return "turn the board clockwise";
    case BoardPrompt::kCounterclockwise:
      return "turn the board counterclockwise";
  }
  return "?";
}

}  // namespace plumbline::lens
