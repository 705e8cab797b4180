// Sequence file of a recording: the time of each image.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "firmware-like/result.h"

namespace plumbline::camera {

struct SequenceFrame {
  double t_s = 0;    ///< time since the start of the recording
  std::string file;  ///< image file, relative to the sequence file; empty if the camera was lost
};

/// Parses a table "t_s,file" with ascending times, one frame per line; the file name is the rest of
/// the line, including commas. Pure.
/// @return at least one frame, or the first fault with its line
Result<std::vector<SequenceFrame>> SequenceFromCsv(std::string_view csv);

}  // namespace plumbline::camera
