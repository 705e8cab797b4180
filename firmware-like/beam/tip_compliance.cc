#include "firmware-like/beam/tip_compliance.h"

#include "firmware-like/beam/beam.h"

namespace plumbline::beam {

TipCompliance TipComplianceOf(const model::Tool& tool, int elements_per_segment) {
  TipCompliance compliance;
  if (tool.rigid) return compliance;
  const Beam beam(tool, elements_per_segment);
  auto tip_under = [&beam](const BeamLoads& loads) {
    const SectionState tip = beam.Solve(loads).Tip();
    Vec6 column;
    column << tip.d_F, tip.r_F;
    return column;
  };
  for (int axis = 0; axis < 3; ++axis) {
    PointLoad force{.z_m = beam.Length()};
    PointLoad moment{.z_m = beam.Length()};
    force.force_F = Vec3::Unit(axis);
    moment.moment_F = Vec3::Unit(axis);
    compliance.C_wrench.col(axis) = tip_under({.points = {force}});
    compliance.C_wrench.col(3 + axis) = tip_under({.points = {moment}});
    compliance.C_gravity.col(axis) = tip_under({.g_F = Vec3::Unit(axis)});
  }
  return compliance;
}

}  // namespace plumbline::beam
