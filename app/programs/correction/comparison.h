// Comparison of two versions of a program: points that differ, and bytes beside them.
#pragma once

#include <string>
#include <vector>

#include "app/programs/brand.h"

namespace plumbline::programs {

struct PointDifference {
  std::string name;
  Place place;  ///< in the new program
  PointKind kind = PointKind::kPose;
  double distance_m = 0, angle_rad = 0;  ///< of a pose
  double joint = 0;                      ///< of joints: the largest difference, in the file's unit
};

/// Bytes beside the numbers of points that differ: the first such line of a file.
struct OtherDifference {
  std::string file;
  int line = 0;  ///< in the new file; 0: only one version has the file
  std::string what;
};

struct ProgramComparison {
  std::vector<PointDifference> points;  ///< only those that differ
  std::size_t compared = 0;
  std::size_t inserted = 0;  ///< points that only the new program has
  std::vector<OtherDifference> others;
  bool same() const { return points.empty() && others.empty(); }
};

/// Files are compared in order. Marks of a correction and blanks before a number do not count. A
/// new program with more points has motions inserted between the old ones: points with a name are
/// matched by it, in order, and those of motions with the nearest of the next ones.
/// @param old_program, new_program  as the brand reads them
ProgramComparison Compare(const Brand& brand, const Program& old_program,
                          const Program& new_program);

}  // namespace plumbline::programs
