// Output of plumbline beam: text tables, CSV, JSON.
#pragma once

#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "app/cli/beam_paper.h"
#include "firmware-like/beam/beam.h"

namespace plumbline::cli {

/// The beam under one force of the series.
struct BeamCase {
  double force_N = 0;
  beam::BeamSolution solution;
};

/// A series of load cases in one plane of bending.
struct BeamSeries {
  model::Tool tool;
  std::string used_tool{};  ///< which of several tools of a cell; empty: the only one
  BendingAxis axis = BendingAxis::kY;
  std::string loads;                 ///< description of all loads
  std::optional<double> force_at_m;  ///< position of force and moment; may be beyond the tip
  std::vector<BeamPoint> points;     ///< points to compensate
  bool stress = false;
  std::vector<BeamCase> cases;
};

/// The section at z. Beyond the tip, at L, on a rigid extension of it:
///   d = d_L + theta_L (z - L),  theta = theta_L
/// Only z_m, d_F and r_F are set.
beam::SectionState SectionOrExtension(const beam::BeamSolution& solution, double z_m);

void PrintBeamTable(const BeamSeries& series, std::ostream& out);

/// One row per node and force: force_N,node,z_mm,displacement_mm,slope_mrad,moment_Nm,shear_N, and
/// with stress normal_MPa,shear_MPa,von_mises_MPa, which are empty if unknown. If the place of the
/// force was given, a row with node `force` follows the nodes: its displacement and slope.
void PrintBeamCsv(const BeamSeries& series, std::ostream& out);

void PrintBeamJson(const BeamSeries& series, std::ostream& out);

/// Table 2 of the paper: this beam model next to the published columns "developed" and "Abaqus".
void PrintPaperTable2(std::ostream& out);

}  // namespace plumbline::cli
