// The loaded tool in the cycle: its tip as a constant linear function of what loads it.
#pragma once

#include "firmware-like/model/cell_model.h"

namespace plumbline {

/// Tip displacement and rotation vector of the tool, [d; r] in F.
///   [d; r] = C_wrench [F; M] + C_gravity g
/// Computed once from the finite elements. For one uniform Euler-Bernoulli segment it is
///   d_x = Fx L^3/(3EI) + My L^2/(2EI) + wx L^4/(8EI),
///   d_y = Fy L^3/(3EI) - Mx L^2/(2EI) + wy L^4/(8EI),  w = density area g,
/// of a weight per length; d_x has I = iy_m4, d_y has I = ix_m4. The tool does not stretch or
/// twist: d_z = r_z = 0. A rigid tool has zeros. Valid for |d|/L < 0.05.
struct TipCompliance {
  Eigen::Matrix<double, 6, 6> C_wrench = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 3> C_gravity = Eigen::Matrix<double, 6, 3>::Zero();

  /// Allocates nothing.
  /// @param force_F   force of the payload [N]
  /// @param moment_F  its moment about the tip of the straight tool [N m]
  /// @param g_F       gravity less the tool's acceleration [m/s^2], which loads the tool itself
  /// @return          displacement [m], then rotation vector [rad]
  Vec6 Bend(const Vec3& force_F, const Vec3& moment_F, const Vec3& g_F) const {
    return C_wrench.leftCols<3>() * force_F + C_wrench.rightCols<3>() * moment_F + C_gravity * g_F;
  }
};

/// Node values do not depend on the number of elements, so that one a segment is enough.
TipCompliance TipComplianceOf(const Tool& tool, int elements_per_segment = 1);

}  // namespace plumbline
