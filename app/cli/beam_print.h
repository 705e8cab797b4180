// Output of plumbline beam: text tables, CSV, JSON.
#pragma once

#include <ostream>
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
  BendingAxis axis = BendingAxis::kY;
  std::string loads;              ///< description of all loads
  std::vector<BeamPoint> points;  ///< points to compensate
  bool stress = false;
  std::vector<BeamCase> cases;
};

void PrintBeamTable(const BeamSeries& series, std::ostream& out);

/// One row per node and force: force_N,node,z_mm,displacement_mm,slope_mrad,moment_Nm,shear_N, and
/// with stress normal_MPa,shear_MPa,von_mises_MPa, which are empty if unknown.
void PrintBeamCsv(const BeamSeries& series, std::ostream& out);

void PrintBeamJson(const BeamSeries& series, std::ostream& out);

/// Table 2 of the paper: this beam model beside the published columns "developed" and "Abaqus".
void PrintPaperTable2(std::ostream& out);

}  // namespace plumbline::cli
