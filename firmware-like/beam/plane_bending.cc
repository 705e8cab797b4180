#include "firmware-like/beam/plane_bending.h"

#include <Eigen/LU>
#include <cassert>
#include <cstddef>

namespace plumbline::beam {
namespace {

using BeamMatrix2 = Eigen::Matrix<BeamReal, 2, 2>;

BeamReal Phi(const PlaneElement& element) {
  return 12 * element.stiffness_Nm2 * element.shear_compliance_per_N /
         (element.length_m * element.length_m);
}

/// Node displacements, by block tridiagonal elimination from the root outwards.
/// @param stiffness  one matrix per element
/// @param force      one entry per node, from the root outwards
std::vector<BeamVector2> NodeDisplacements(const std::vector<BeamMatrix4>& stiffness,
                                           std::vector<BeamVector2> force) {
  const std::size_t n = stiffness.size();
  std::vector<BeamMatrix2> inverse_pivot(n);
  for (std::size_t e = 0; e < n; ++e) {
    BeamMatrix2 pivot = stiffness[e].bottomRightCorner<2, 2>();
    if (e > 0) {
      const BeamMatrix2 coupling = stiffness[e].bottomLeftCorner<2, 2>();
      pivot -= coupling * inverse_pivot[e - 1] * coupling.transpose();
      force[e + 1] -= coupling * inverse_pivot[e - 1] * force[e];
    }
    if (e + 1 < n) pivot += stiffness[e + 1].topLeftCorner<2, 2>();
    inverse_pivot[e] = pivot.inverse();
  }
  std::vector<BeamVector2> displacement(n + 1, BeamVector2::Zero());
  for (std::size_t e = n; e-- > 0;) {
    BeamVector2 right_side = force[e + 1];
    if (e + 1 < n) right_side -= stiffness[e + 1].topRightCorner<2, 2>() * displacement[e + 2];
    displacement[e + 1] = inverse_pivot[e] * right_side;
  }
  return displacement;
}

}  // namespace

BeamMatrix4 StiffnessMatrix(const PlaneElement& element) {
  const BeamReal l = element.length_m;
  const BeamReal phi = Phi(element);
  BeamMatrix4 k;
  k << 12, 6 * l, -12, 6 * l,                               //
      6 * l, (4 + phi) * l * l, -6 * l, (2 - phi) * l * l,  //
      -12, -6 * l, 12, -6 * l,                              //
      6 * l, (2 - phi) * l * l, -6 * l, (4 + phi) * l * l;
  return element.stiffness_Nm2 / (l * l * l * (1 + phi)) * k;
}

Eigen::Vector4d NodalLoads(const PlaneElement& element, const PlaneLoad& load) {
  const double l = element.length_m;
  const double ei = element.stiffness_Nm2;
  // Far-end displacement under the loads alone; V and M at the near end must cancel it.
  const PlaneState free = StateAt(element, load, PlaneState{}, l);
  PlaneState clamped;
  clamped.shear_N = 12 * ei / (l * l * l * (1 + static_cast<double>(Phi(element)))) *
                    (free.theta_rad * l / 2 - free.u_m);
  clamped.moment_Nm = clamped.shear_N * l / 2 - ei * free.theta_rad / l;
  const PlaneState far = StateAt(element, load, clamped, l);
  return {clamped.shear_N, clamped.moment_Nm, -far.shear_N, -far.moment_Nm};
}

PlaneState StateAt(const PlaneElement& element, const PlaneLoad& load, const PlaneState& start,
                   double s_m) {
  const double s = s_m;
  const double w0 = load.w0_N_m;
  const double w1 = load.w1_N_m2;
  PlaneState state;
  // V and M, then the first and second integrals of M and the integral of V.
  state.shear_N = start.shear_N - w0 * s - w1 * s * s / 2;
  state.moment_Nm = start.moment_Nm - start.shear_N * s + w0 * s * s / 2 + w1 * s * s * s / 6;
  double bend = s * (start.moment_Nm - s * (start.shear_N / 2 - s * (w0 / 6 + s * w1 / 24)));
  double sag =
      s * s * (start.moment_Nm / 2 - s * (start.shear_N / 6 - s * (w0 / 24 + s * w1 / 120)));
  double shear_sum = s * (start.shear_N - s * (w0 / 2 + s * w1 / 6));
  for (const PlanePointLoad& point : load.points) {
    const double r = s - point.s_m;
    if (r <= 0) continue;
    state.shear_N -= point.force_N;
    state.moment_Nm += point.force_N * r - point.moment_Nm;
    bend += point.force_N * r * r / 2 - point.moment_Nm * r;
    sag += point.force_N * r * r * r / 6 - point.moment_Nm * r * r / 2;
    shear_sum -= point.force_N * r;
  }
  state.theta_rad = start.theta_rad + bend / element.stiffness_Nm2;
  state.u_m = start.u_m + start.theta_rad * s + sag / element.stiffness_Nm2 +
              shear_sum * element.shear_compliance_per_N;
  return state;
}

std::vector<PlaneState> SolveCantilever(const std::vector<PlaneElement>& elements,
                                        const std::vector<PlaneLoad>& loads,
                                        const std::vector<Eigen::Vector2d>& node_loads) {
  const std::size_t n = elements.size();
  assert(loads.size() == n && node_loads.size() == n + 1);
  std::vector<BeamMatrix4> stiffness(n);
  std::vector<Eigen::Vector4d> equivalent(n);
  std::vector<BeamVector2> force(n + 1);
  for (std::size_t i = 0; i <= n; ++i) force[i] = node_loads[i].cast<BeamReal>();
  for (std::size_t e = 0; e < n; ++e) {
    stiffness[e] = StiffnessMatrix(elements[e]);
    equivalent[e] = NodalLoads(elements[e], loads[e]);
    force[e] += equivalent[e].head<2>().cast<BeamReal>();
    force[e + 1] += equivalent[e].tail<2>().cast<BeamReal>();
  }
  const std::vector<BeamVector2> displacement = NodeDisplacements(stiffness, force);
  std::vector<PlaneState> ends(n);
  for (std::size_t e = 0; e < n; ++e) {
    const BeamVector2& near = displacement[e];
    const BeamVector2& far = displacement[e + 1];
    // Subtracting the rigid-body motion first avoids cancellation in elements far from the root.
    const BeamVector2 strain(far[0] - near[0] - near[1] * elements[e].length_m, far[1] - near[1]);
    const BeamVector2 force_on_near = stiffness[e].topRightCorner<2, 2>() * strain;
    ends[e] = {.u_m = static_cast<double>(near[0]),
               .theta_rad = static_cast<double>(near[1]),
               .shear_N = static_cast<double>(equivalent[e][0] - force_on_near[0]),
               .moment_Nm = static_cast<double>(equivalent[e][1] - force_on_near[1])};
  }
  return ends;
}

}  // namespace plumbline::beam
