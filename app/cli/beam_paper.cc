#include "app/cli/beam_paper.h"

#include <fmt/ostream.h>

#include <cmath>
#include <cstddef>

#include "app/cli/rounded.h"

namespace plumbline::cli {
namespace {

double Displacement(const beam::SectionState& state, BendingAxis axis) {
  return state.d_F[static_cast<int>(axis)];
}

/// Rotation of the section, positive if it moves the outboard end along the positive axis.
double Slope(const beam::SectionState& state, BendingAxis axis) {
  return axis == BendingAxis::kX ? state.r_F.y() : -state.r_F.x();
}

}  // namespace

std::vector<double> ElementAngles(const beam::BeamSolution& solution, BendingAxis axis) {
  std::vector<double> angles;
  for (int n = 0; n + 1 < solution.node_count(); ++n) {
    const double length_m = solution.elements()[static_cast<std::size_t>(n)].length_m;
    angles.push_back(
        (Displacement(solution.Node(n + 1), axis) - Displacement(solution.Node(n), axis)) /
        length_m);
  }
  return angles;
}

BeamPoint CompensatedByElementAngle(const beam::BeamSolution& solution, BendingAxis axis,
                                    const BeamPoint& point) {
  const auto element = static_cast<std::size_t>(solution.ElementAt(point.z_m));
  const double theta = ElementAngles(solution, axis)[element];
  return {.z_m = point.z_m * std::cos(theta), .y_m = point.y_m - point.z_m * std::sin(theta)};
}

BeamPoint LoadedPoint(const beam::BeamSolution& solution, BendingAxis axis,
                      const BeamPoint& point) {
  const beam::SectionState section = solution.At(point.z_m);
  const double theta = Slope(section, axis);
  return {.z_m = point.z_m - point.y_m * std::sin(theta),
          .y_m = Displacement(section, axis) + point.y_m * std::cos(theta)};
}

BeamPoint CompensatedBySection(const beam::BeamSolution& solution, BendingAxis axis,
                               const BeamPoint& point) {
  const BeamPoint loaded = LoadedPoint(solution, axis, point);
  return {.z_m = 2 * point.z_m - loaded.z_m, .y_m = 2 * point.y_m - loaded.y_m};
}

model::Tool PaperTool() {
  model::Tool tool;
  tool.rigid = false;
  tool.segments = {{.length_m = 1.8,
                    .section = model::RectangleSection(0.05, 0.05),
                    .material = {.youngs_modulus_Pa = 200e9, .poisson_ratio = 0.3}}};
  tool.tcp_F = Vec3(0, 0, 1.8);
  return tool;
}

const std::vector<PaperTable2Row>& PaperTable2() {
  static const std::vector<PaperTable2Row> kRows{
      {100, {0.2764, 0.9676, 1.8662}, {0.1705, 0.8753, 1.7954}},
      {200, {0.5529, 1.9353, 3.7324}, {0.4439, 1.7348, 3.1224}},
      {300, {0.8294, 2.9030, 5.5987}, {0.7146, 2.8013, 5.0334}},
      {400, {1.1059, 3.8707, 7.4649}, {1.0031, 3.6454, 6.9867}},
      {500, {1.3824, 4.8384, 9.3312}, {1.2913, 4.5564, 8.8441}},
      {1000, {2.7648, 9.6768, 18.662}, {2.6554, 9.4785, 17.127}},
  };
  return kRows;
}

void PrintPaperTable2(std::ostream& out) {
  const model::Tool tool = PaperTool();
  out << "Table 2 of Park & Park (2012): a cantilever of 1800 x 50 x 50 mm, E = 200 GPa,\n"
         "three elements of 600 mm, a force at its tip. The paper prints E = 2 GPa and 600 mm,\n"
         "which would give 3.70 times these displacements.\n\n";
  fmt::print(out, "  {:>7} {:>5} {:>12} {:>12} {:>12} {:>12} {:>12}\n", "force", "node",
             "this beam", "developed", "difference", "Abaqus", "developed");
  fmt::print(out, "  {:>7} {:>5} {:>12} {:>12} {:>12} {:>12} {:>12}\n", "N", "", "mm",
             "published mm", "mm", "published mm", "/ Abaqus");
  const beam::Beam beam(tool, kPaperElements);
  for (const PaperTable2Row& row : PaperTable2()) {
    const beam::BeamSolution solution =
        beam.Solve({.points = {{beam.Length(), Vec3(0, row.force_N, 0), Vec3::Zero()}}});
    for (int i = 0; i < 3; ++i) {
      const double ours_mm = 1e3 * solution.Node(i + 1).d_F.y();
      fmt::print(out, "  {:>7} {:>5} {:>12.4f} {:>12.4f} {:>12.4f} {:>12.4f} {:>12.3f}\n",
                 i == 0 ? fmt::format("{:.0f}", row.force_N) : "", i + 2, ours_mm,
                 row.developed_mm[i], WithoutNegativeZero(ours_mm - row.developed_mm[i], 4),
                 row.abaqus_mm[i], row.developed_mm[i] / row.abaqus_mm[i]);
    }
  }
}

}  // namespace plumbline::cli
