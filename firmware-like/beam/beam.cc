#include "firmware-like/beam/beam.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>

namespace plumbline::beam {
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
