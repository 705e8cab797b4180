// Frame that every sheet has in common: title, rulers, instructions, lines for a configuration
// file.
#pragma once

#include <string>
#include <vector>

#include "app/vision/print/sheet.h"

namespace plumbline::vision {

/// Length of both rulers [mm].
inline constexpr double kRulerLength_mm = 100;

/// Texts of a frame.
struct FrameTexts {
  std::string title = {};               ///< top left
  std::string sheet_number = {};        ///< top right; may be empty
  std::vector<std::string> notes = {};  ///< at most two lines, below the ruler
  std::string file = {};                ///< name of the configuration file
  /// Blocks of lines for that file, at most kMaxBlocks of kMaxBlockLines lines, or one longer
  /// block.
  std::vector<std::vector<std::string>> blocks = {};
};
inline constexpr std::size_t kMaxBlocks = 6;

/// The area that the frame leaves free on a paper of this size [mm].
Rectangle FreeArea(const Vec2& paper);

/// Adds the frame to a sheet.
void AddFrame(Sheet& sheet, const Vec2& paper, const FrameTexts& texts);

/// Adds an arrow that points up, with the word beside it.
/// @param at  middle of its lower end [mm]
void AddUpArrow(Sheet& sheet, const Vec2& at);

/// Adds a horizontal dimension line: ticks at both ends, the text below its middle.
/// @param from   left end [mm]
/// @param length [mm]
/// @param room   maximum width of the text [mm]
void AddDimension(Sheet& sheet, const Vec2& from, double length, const std::string& words,
                  double room);

/// Height of a dimension line with its text [mm].
inline constexpr double kDimensionHeight_mm = 6;

}  // namespace plumbline::vision
