// Tip compliance of the tool: displacement and rotation as a constant linear function of its loads.
#pragma once

#include "firmware-like/model/cell_model.h"

namespace plumbline::beam {

/// Tip displacement and rotation vector of the tool, [d; r] in F.
///   [d; r] = C_wrench [F; M] + C_gravity g
/// Computed once from the finite elements. For one uniform Euler-Bernoulli segment,
///   d_x = Fx L^3/(3EI) + My L^2/(2EI) + wx L^4/(8EI),
///   d_y = Fy L^3/(3EI) - Mx L^2/(2EI) + wy L^4/(8EI),
/// with w = density area g the weight per length, I = iy_m4 for d_x and ix_m4 for d_y. The tool
/// does not stretch or twist: d_z = r_z = 0. A rigid tool has zero compliance. Valid for |d|/L <
/// 0.05.
struct TipCompliance {
  Eigen::Matrix<double, 6, 6> C_wrench = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 3> C_gravity = Eigen::Matrix<double, 6, 3>::Zero();

  /// Tip displacement [m], then rotation vector [rad], in F. Does not allocate.
  /// @param force_F   force of the payload [N]
  /// @param moment_F  its moment about the tip of the undeflected tool [N m]
  /// @param g_F       gravity minus the acceleration of the tool [m/s^2], which loads the tool
  ///                  itself
  Vec6 Bend(const Vec3& force_F, const Vec3& moment_F, const Vec3& g_F) const {
    return C_wrench.leftCols<3>() * force_F + C_wrench.rightCols<3>() * moment_F + C_gravity * g_F;
  }
};

/// Computes the compliance of a tool. One element per segment is enough, because node values do not
/// depend on the number of elements.
TipCompliance TipComplianceOf(const model::Tool& tool, int elements_per_segment = 1);

}  // namespace plumbline::beam
