// A recorded sequence: which image was taken when.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "firmware-like/result.h"

namespace plumbline {

struct SequenceFrame {
  double t_s = 0;    ///< since the beginning of the recording
  std::string file;  ///< image file, relative to the sequence file; empty: the camera was lost
};

/// Frames of a table "t_s,file" with ascending times, one line each; the file's name is the rest of
/// the line, commas and all. At least one frame. A pure function.
/// @return the frames, or the first fault with its line
Result<std::vector<SequenceFrame>> SequenceFromCsv(std::string_view csv);

}  // namespace plumbline
