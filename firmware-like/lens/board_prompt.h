// What whoever holds the calibration board is asked to do next.
#pragma once

#include <cstdint>
#include <string_view>

namespace plumbline {

/// The numbers are the PLC's: they do not change.
enum class BoardPrompt : std::uint8_t {
  kNone = 0,       ///< nothing is captured
  kShowBoard = 1,  ///< the whole board, upright, into the image
  kHoldStill = 2,  ///< it moves, or is blurred
  kTiltLeft = 3,   ///< its edge at the left of the image towards the camera
  kTiltRight = 4,
  kTiltUpper = 5,
  kTiltLower = 6,
  kUpperLeft = 7,  ///< to that corner of the image, tilted a little
  kUpperRight = 8,
  kLowerLeft = 9,
  kLowerRight = 10,
  kCloser = 11,
  kFarther = 12,
};
inline constexpr int kBoardPrompts = 13;

/// Words for a screen or a log line.
constexpr std::string_view BoardPromptText(BoardPrompt prompt) {
  switch (prompt) {
    case BoardPrompt::kNone:
      return "";
    case BoardPrompt::kShowBoard:
      return "show the whole board";
    case BoardPrompt::kHoldStill:
      return "hold still";
    case BoardPrompt::kTiltLeft:
      return "tilt the board's left edge towards the camera";
    case BoardPrompt::kTiltRight:
      return "tilt the board's right edge towards the camera";
    case BoardPrompt::kTiltUpper:
      return "tilt the board's upper edge towards the camera";
    case BoardPrompt::kTiltLower:
      return "tilt the board's lower edge towards the camera";
    case BoardPrompt::kUpperLeft:
      return "bring the board to the upper left corner of the image";
    case BoardPrompt::kUpperRight:
      return "bring the board to the upper right corner of the image";
    case BoardPrompt::kLowerLeft:
      return "bring the board to the lower left corner of the image";
    case BoardPrompt::kLowerRight:
      return "bring the board to the lower right corner of the image";
    case BoardPrompt::kCloser:
      return "closer";
    case BoardPrompt::kFarther:
      return "farther away";
  }
  return "?";
}

}  // namespace plumbline
