// The cell seen from above and from the side: one panel that fits all points, with the arm's reach.
#pragma once

#include <string>
#include <vector>

#include "firmware-like/model/cell_model.h"

namespace plumbline {

/// A projection along one axis of W.
struct Projection {
  int right, up;  ///< axes of W
  const char* name;
};

inline constexpr Projection kProjections[] = {{0, 1, "seen from above"},
                                              {0, 2, "seen from the side"}};

/// The part of the cell that a set of points in W takes up, the base included. [mm]
class CellView {
 public:
  CellView(const CellModel& cell, const std::vector<Vec3>& points_W);

  /// Side of the drawn square [mm].
  double extent_mm() const { return 2 * half_mm_; }

  /// Starts a panel: canvas, axes, base, and the data of kOutline.
  std::string Begin(const Projection& projection) const;

  /// First item of the panel's plot command: the outline of where the tip can get to.
  static constexpr const char* kOutline =
      "$outline using 1:2 with lines linecolor rgb '#a9b4bb' linewidth 1";

 private:
  Vec3 base_mm_, centre_mm_;
  double half_mm_ = 0;
  std::vector<Vec3> reached_mm_;  ///< where the tip can get to, sampled inside the joint limits
};

}  // namespace plumbline
