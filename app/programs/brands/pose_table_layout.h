// Which column of a table of poses is which number.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "app/base/text/delimited_text.h"
#include "firmware-like/result.h"

namespace plumbline::programs::pose_table {

enum class Orientation {
  kRpyDegrees,  ///< roll, pitch, yaw; W, P, R; C, B, A: R = Rz Ry Rx
  kRpyRadians,
  kVectorRadians,  ///< axis times angle
  kQuaternion,     ///< w, x, y, z
};

struct Layout {
  text::DelimitedText table;
  double m_per_unit = 1e-3;
  Orientation orientation = Orientation::kRpyDegrees;
  std::array<std::size_t, 3> position{};
  std::vector<std::size_t> angles;  ///< columns, in the order of the orientation
  std::vector<std::size_t> joints;  ///< may be empty
  double rad_per_joint_unit = 1;
  bool has_pose = false;
  std::optional<std::size_t> name, tool, base, load;
};

/// Understands a table by its column names and their units. Names as in measured tables
/// (app/measure/imports): x, y, z with a unit, qw .. qz, joints; besides these roll, pitch, yaw;
/// w, p, r; a, b, c; rotvec_x, rotvec_y, rotvec_z; tool, base, load. The error says which header to
/// add: rx, ry, rz is ambiguous (rotation vector, or angles in either order), and so is a number
/// without a unit.
Result<Layout> LayoutOf(std::string_view bytes);

}  // namespace plumbline::programs::pose_table
