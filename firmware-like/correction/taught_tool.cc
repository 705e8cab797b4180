#include "firmware-like/correction/taught_tool.h"

namespace plumbline::correction {

std::optional<int> TaughtTool(const deflection::LoadedArm& arm, const AssemblyPoint& point) {
  if (arm.tools() == 1) return 0;
  if (!point.near_q) return std::nullopt;
  int nearest = 0;
  double least_m = 0;
  for (int tool = 0; tool < arm.tools(); ++tool) {
    const Vec3 point_W = arm.X_WB() * (arm.UnloadedTip(*point.near_q, tool) * point.p_TP);
    const double distance_m = (point_W - point.X_WP.p).norm();
    if (tool > 0 && distance_m >= least_m) continue;
    nearest = tool;
    least_m = distance_m;
  }
  return nearest;
}

}  // namespace plumbline::correction
