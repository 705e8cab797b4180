// Tag families: the codes of the AprilTag families and of the ArUco dictionaries.
//
// A tag is a square of N x N data cells inside a black border of one cell, on white. Its code has
// N * N bits, row by row from the tag's own top left, most significant bit first; 1 is white.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware-like/result.h"

namespace plumbline::target {

struct TagFamily {
  std::string name;          ///< as on the command line
  int data_cells = 0;        ///< N, 4 to 7
  int correctable_bits = 0;  ///< wrong cells that are corrected
  /// Random cells match a code so often that a square must also be printed cleanly: see
  /// ReadCells().
  bool strict = false;
  std::vector<std::uint64_t> codes;  ///< by id

  int cells() const { return data_cells + 2; }  ///< per side, including the border
};

/// Names are "36h11", "36h10", "25h9", "16h5", "aruco-4x4-50" .. "aruco-7x7-1000" and
/// "aruco-original". The tables are OpenCV's; it draws the AprilTag families rotated by half a
/// turn, which is corrected here to match the AprilTag library.
/// @return  an error that lists the names if there is no such family
Result<TagFamily> TagFamilyOfName(std::string_view name);

/// Whether OpenCV draws the tags of this family rotated by half a turn: the AprilTag families.
bool OpenCvTurns(const TagFamily& family);

/// All names separated by ", ", for help and messages.
std::string TagFamilyNames();

/// The code that a square of cells was matched to.
struct TagCode {
  int id = 0;
  int wrong_bits = 0;  ///< cells that differ from the code
  int turns = 0;       ///< clockwise quarter turns by which the tag is rotated in the image
};

/// The tag whose code is nearest to the bits read, in any of four orientations.
/// @return  nullopt if more cells differ than `most_wrong_bits`
std::optional<TagCode> NearestTag(const TagFamily& family, std::uint64_t read, int most_wrong_bits);

/// The same; nullopt if more cells differ than the family corrects.
inline std::optional<TagCode> NearestTag(const TagFamily& family, std::uint64_t read) {
  return NearestTag(family, read, family.correctable_bits);
}

/// The bits read from a tag that is rotated clockwise by a quarter turn.
std::uint64_t RotatedClockwise(std::uint64_t code, int data_cells);

}  // namespace plumbline::target
