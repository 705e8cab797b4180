#include "firmware-like/beam/beam.h"

#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <utility>

namespace plumbline::beam {
namespace {

constexpr int kStations = 10;

/// Adds the zeros of V(s) = V0 - w0 s - w1 s^2/2 in (0, length).
void AddShearZeros(double v0, double w0, double w1, double length_m, std::vector<double>& at) {
  const double a = -w1 / 2;
  const double b = -w0;
  const double discriminant = b * b - 4 * a * v0;
  if (discriminant < 0) return;
  const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
  if (q == 0) return;
  for (const double s : {q / a, v0 / q}) {
    if (std::isfinite(s) && s > 0 && s < length_m) at.push_back(s);
  }
}

std::vector<double> StressStations(const BeamSolution& solution, int element) {
  const double length_m = solution.elements()[element].length_m;
  std::vector<double> at;
  for (int i = 0; i <= kStations; ++i) at.push_back(length_m * i / kStations);
  const Vec3 start_force_F = solution.InElement(element, 0).force_F;
  for (int plane = 0; plane < 2; ++plane) {
    const PlaneLoad& load = solution.LoadIn(element, plane);
    for (const PlanePointLoad& point : load.points) {
      at.push_back(point.s_m);
      at.push_back(std::nextafter(point.s_m, length_m));
    }
    // A point load in the element shifts the zeros outboard of it.
    double v0 = start_force_F[plane];
    AddShearZeros(v0, load.w0_N_m, load.w1_N_m2, length_m, at);
    for (const PlanePointLoad& point : load.points) {
      v0 -= point.force_N;
      AddShearZeros(v0, load.w0_N_m, load.w1_N_m2, length_m, at);
    }
  }
  return at;
}

}  // namespace

std::optional<SectionStress> StressOf(const model::Section& section, const SectionState& state) {
  if (section.reach_x_m <= 0 || section.reach_y_m <= 0) return std::nullopt;
  const double along_x_Pa = std::abs(state.moment_F.y()) * section.reach_x_m / section.iy_m4;
  const double along_y_Pa = std::abs(state.moment_F.x()) * section.reach_y_m / section.ix_m4;
  SectionStress stress;
  stress.normal_Pa = section.round ? std::hypot(along_x_Pa, along_y_Pa) : along_x_Pa + along_y_Pa;
  stress.shear_Pa = std::hypot(state.force_F.x() / section.peak_shear_x_m2,
                               state.force_F.y() / section.peak_shear_y_m2);
  stress.von_mises_Pa = std::hypot(stress.normal_Pa, std::sqrt(3.0) * stress.shear_Pa);
  return stress;
}

ElementStress StressInElement(const BeamSolution& solution, int element) {
  const model::Section& section = solution.elements()[element].section;
  ElementStress found;
  found.largest_moment = found.largest_shear = solution.InElement(element, 0);
  for (const double s_m : StressStations(solution, element)) {
    const SectionState state = solution.InElement(element, s_m);
    if (state.moment_F.norm() > found.largest_moment.moment_F.norm()) found.largest_moment = state;
    if (state.force_F.norm() > found.largest_shear.force_F.norm()) found.largest_shear = state;
    const auto stress = StressOf(section, state);
    if (stress && (!found.peak || stress->von_mises_Pa > found.peak->stress.von_mises_Pa)) {
      found.peak = ElementStress::Peak{state.z_m, *stress};
    }
  }
  return found;
}

LargestStress LargestStressOf(const BeamSolution& solution) {
  LargestStress largest;
  for (int element = 0; element + 1 < solution.node_count(); ++element) {
    const auto peak = StressInElement(solution, element).peak;
    if (!peak) {
      largest.complete = false;
    } else if (!largest.peak || peak->stress.von_mises_Pa > largest.peak->stress.von_mises_Pa) {
      largest.peak = peak;
      largest.element = element;
    }
  }
  return largest;
}

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

namespace {

/// Loads closer to a node than this act on the node; as a share of the beam's length.
constexpr double kAtNode = 1e-12;

PlaneElement ElementAlongX(const model::ToolSegment& element, model::BeamTheory theory) {
  const model::Section& section = element.section;
  const double shear_stiffness_N =
      section.shear_x * element.material.ShearModulus() * section.area_m2;
  return {.length_m = element.length_m,
          .stiffness_Nm2 = element.material.youngs_modulus_Pa * section.iy_m4,
          .shear_compliance_per_N =
              theory == model::BeamTheory::kTimoshenko ? 1 / shear_stiffness_N : 0.0};
}

PlaneElement ElementAlongY(model::ToolSegment element, model::BeamTheory theory) {
  std::swap(element.section.ix_m4, element.section.iy_m4);
  std::swap(element.section.shear_x, element.section.shear_y);
  return ElementAlongX(element, theory);
}

}  // namespace

SectionState BeamSolution::Node(int node) const {
  if (node == 0) return InElement(0, 0);
  const double length_m = elements_[node - 1].length_m;
  return InElement(node - 1, length_m);
}

SectionState BeamSolution::At(double z_m) const {
  const int element = ElementAt(z_m);
  const double length_m = elements_[element].length_m;
  return InElement(element, std::clamp(z_m - NodeZ(element), 0.0, length_m));
}

SectionState BeamSolution::InElement(int element, double s_m) const {
  const auto e = static_cast<std::size_t>(element);
  const auto& [x, y] = planes_;
  const PlaneState along_x = StateAt(x.elements[e], x.loads[e], x.ends[e], s_m);
  const PlaneState along_y = StateAt(y.elements[e], y.loads[e], y.ends[e], s_m);
  return {.z_m = node_z_[e] + s_m,
          .d_F = Vec3(along_x.u_m, along_y.u_m, 0),
          .r_F = Vec3(-along_y.theta_rad, along_x.theta_rad, 0),
          .force_F = Vec3(along_x.shear_N, along_y.shear_N, 0),
          .moment_F = Vec3(-along_y.moment_Nm, along_x.moment_Nm, 0)};
}

int BeamSolution::ElementAt(double z_m) const {
  const auto outboard = std::lower_bound(node_z_.begin() + 1, node_z_.end() - 1, z_m);
  return static_cast<int>(outboard - node_z_.begin()) - 1;
}

Beam::Beam(const model::Tool& tool, int elements_per_segment)
    : Beam(tool, std::vector<int>(tool.segments.size(), elements_per_segment)) {}

Beam::Beam(const model::Tool& tool, const std::vector<int>& elements_of_segment) {
  assert(!tool.segments.empty() && elements_of_segment.size() == tool.segments.size());
  unloaded_.node_z_.push_back(0);
  double root_m = 0;
  for (std::size_t i = 0; i < tool.segments.size(); ++i) {
    model::ToolSegment element = tool.segments[i];
    const int count = elements_of_segment[i];
    assert(count > 0 && element.length_m > 0 && element.section.area_m2 > 0);
    assert(element.material.youngs_modulus_Pa > 0);
    assert(element.section.ix_m4 > 0 && element.section.iy_m4 > 0);
    const double segment_m = element.length_m;
    element.length_m = segment_m / count;
    for (int k = 1; k <= count; ++k) {
      unloaded_.elements_.push_back(element);
      unloaded_.node_z_.push_back(root_m + segment_m * k / count);
      unloaded_.planes_[0].elements.push_back(ElementAlongX(element, tool.theory));
      unloaded_.planes_[1].elements.push_back(ElementAlongY(element, tool.theory));
    }
    root_m += segment_m;
  }
  for (auto& plane : unloaded_.planes_) {
    plane.loads.resize(unloaded_.elements_.size());
    plane.node_loads.assign(unloaded_.node_z_.size(), Eigen::Vector2d::Zero());
  }
}

/// Adds weight and inertia of the beam itself: w = rho A (g - a - alpha x (0, 0, z)).
void Beam::AddField(BeamSolution& solution, const BeamLoads& loads) {
  for (std::size_t e = 0; e < solution.elements_.size(); ++e) {
    const model::ToolSegment& element = solution.elements_[e];
    const double mass_kg_m = element.material.density_kg_m3 * element.section.area_m2;
    const Vec3 growth = -loads.angular_acceleration_F.cross(Vec3::UnitZ());
    const Vec3 at_start = loads.g_F - loads.acceleration_F + solution.node_z_[e] * growth;
    for (std::size_t axis = 0; axis < 2; ++axis) {
      PlaneLoad& load = solution.planes_[axis].loads[e];
      load.w0_N_m = mass_kg_m * at_start[static_cast<int>(axis)];
      load.w1_N_m2 = mass_kg_m * growth[static_cast<int>(axis)];
    }
  }
}

void Beam::AddPoint(BeamSolution& solution, const PointLoad& load) {
  const double length_m = solution.node_z_.back();
  const double tolerance_m = kAtNode * length_m;
  assert(load.z_m >= 0 && load.z_m <= length_m + tolerance_m);
  const auto e = static_cast<std::size_t>(solution.ElementAt(load.z_m));
  const double s_m = load.z_m - solution.node_z_[e];
  const bool at_near = s_m <= tolerance_m;
  const bool at_far = solution.elements_[e].length_m - s_m <= tolerance_m;
  const double moments_Nm[] = {load.moment_F.y(), -load.moment_F.x()};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    auto& plane = solution.planes_[axis];
    const double force_N = load.force_F[static_cast<int>(axis)];
    if (at_near || at_far) {
      plane.node_loads[at_near ? e : e + 1] += Eigen::Vector2d(force_N, moments_Nm[axis]);
    } else {
      plane.loads[e].points.push_back({s_m, force_N, moments_Nm[axis]});
    }
  }
}

BeamSolution Beam::Solve(const BeamLoads& loads) const {
  BeamSolution solution = unloaded_;
  AddField(solution, loads);
  for (const PointLoad& load : loads.points) AddPoint(solution, load);
  for (const PointMass& mass : loads.masses) {
    const Vec3 force_F = mass.mass_kg * (loads.g_F - loads.acceleration_F -
                                         loads.angular_acceleration_F.cross(mass.cog_F));
    const Vec3 moment_F = (mass.cog_F - Vec3(0, 0, mass.z_m)).cross(force_F);
    AddPoint(solution, {.z_m = mass.z_m, .force_F = force_F, .moment_F = moment_F});
  }
  for (auto& plane : solution.planes_) {
    plane.ends = SolveCantilever(plane.elements, plane.loads, plane.node_loads);
  }
  return solution;
}

}  // namespace plumbline::beam
