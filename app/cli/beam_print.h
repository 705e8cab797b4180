// What plumbline beam writes: tables for the eye, CSV, JSON.
#pragma once

#include <ostream>
#include <vector>

#include "app/cli/beam_paper.h"
#include "firmware-like/beam/beam.h"

namespace plumbline {

/// The beam under one force of the series.
struct BeamCase {
  double force_N = 0;
  BeamSolution solution;
};

/// A series of load cases in one plane of bending.
struct BeamSeries {
  Tool tool;
  BendingAxis axis = BendingAxis::kY;
  std::string loads;              ///< in words: what acts besides the force, and where
  std::vector<BeamPoint> points;  ///< to be compensated
  bool stress = false;
  std::vector<BeamCase> cases;
};

void PrintBeamTable(const BeamSeries& series, std::ostream& out);

/// One row a node and force: force_N,node,z_mm,displacement_mm,slope_mrad,moment_Nm,shear_N, and
/// with stress normal_MPa,shear_MPa,von_mises_MPa, empty where not known.
void PrintBeamCsv(const BeamSeries& series, std::ostream& out);

void PrintBeamJson(const BeamSeries& series, std::ostream& out);

/// The paper's Table 2: this beam, the column published as developed, and that of Abaqus.
void PrintPaperTable2(std::ostream& out);

}  // namespace plumbline
