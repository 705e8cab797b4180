// Plan and side view of the cell: a panel scaled to a set of points, with the outline of the reach.
#pragma once

#include <string>
#include <vector>

#include "firmware-like/model/cell_model.h"

namespace plumbline::measure {

/// Orthographic projection along one axis of W.
struct Projection {
  int right, up;  ///< indices of the W axes drawn to the right and upwards
  const char* name;
};

inline constexpr Projection kProjections[] = {{0, 1, "from above"}, {0, 2, "from the side"}};

/// View of the part of the cell that contains a set of points in W and the base [mm].
class CellView {
 public:
  CellView(const model::CellModel& cell, const std::vector<Vec3>& points_W);

  /// Side of the drawn square [mm].
  double extent_mm() const { return 2 * half_mm_; }

  /// Starts a panel: canvas, axes, base, and the data of kOutline.
  std::string Begin(const Projection& projection) const;

  /// First item of the panel's plot command: the outline of the tip's reach.
  static constexpr const char* kOutline =
      "$outline using 1:2 with lines linecolor rgb '#a9b4bb' linewidth 1";

 private:
  Vec3 base_mm_, centre_mm_;
  double half_mm_ = 0;
  std::vector<Vec3> reached_mm_;  ///< reachable tip positions, sampled within the joint limits
};

}  // namespace plumbline::measure
