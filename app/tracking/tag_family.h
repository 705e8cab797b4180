// The codes that square tags carry: AprilTag 36h11 and the ArUco dictionaries.
//
// A tag is a square of N x N data cells inside a black border of one cell, on white. Its code is
// the data row by row from the tag's own top left, the first cell in the most significant of the
// N * N bits, 1 white.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware-like/result.h"

namespace plumbline {

struct TagFamily {
  std::string name;                  ///< as on the command line
  int data_cells = 0;                ///< N, 4 to 7
  int correctable_bits = 0;          ///< wrong cells that are put right
  std::vector<std::uint64_t> codes;  ///< by id

  int cells() const { return data_cells + 2; }  ///< of a side, with the border
};

/// The families by name: "36h11", "aruco-4x4-50" .. "aruco-7x7-1000", "aruco-original". The tables
/// are those that OpenCV carries; 36h11 is turned by half a turn there, and put upright here, as
/// the AprilTag library prints it.
Result<TagFamily> TagFamilyOfName(std::string_view name);

/// All names, for help and for messages, separated by ", ".
std::string TagFamilyNames();

/// What a square of cells turned out to be.
struct TagCode {
  int id = 0;
  int wrong_bits = 0;  ///< cells that differ from the code
  int turns = 0;       ///< quarter turns clockwise by which the tag stands in the reading
};

/// The tag whose code is nearest to what was read, in any of four orientations; nothing where more
/// cells differ than the family corrects.
std::optional<TagCode> NearestTag(const TagFamily& family, std::uint64_t read);

/// The code as it is read when the tag is turned clockwise by a quarter turn.
std::uint64_t TurnedClockwise(std::uint64_t code, int data_cells);

}  // namespace plumbline
