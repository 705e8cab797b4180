// The beam of Park & Park (2012): its Table 2 and its point compensation, for comparison.
//
// Park & Park, "Development of a Software Based Calibration System for Automobile Assembly System
// Oriented AR", DAAAM International Scientific Book 2012, ch. 44.
//
// Table 2 checks the paper's system on a cantilever under a tip force of 100 to 1000 N. The
// parameters printed in the paper are not those that reproduce the table:
//
//                            printed                     reproduces the table
//   E                        2 GPa                       200 GPa
//   length                   600 mm in total             1800 mm: three elements of 600 mm
//   section                  50 x 50 mm                  50 x 50 mm
//   nodes 2, 3, 4 at 100 N   1.024, 3.584, 6.912 mm      0.2765, 0.9677, 1.8662 mm
//
// The published column "developed system" reads 0.2764, 0.9676, 1.8662 mm at 100 N. The printed
// parameters give 3.70 times these values. The parameters on the right give all eighteen values to
// the last printed digit; some published values were truncated instead of rounded.
//
// The adjacent column, from a commercial finite-element program, cannot come from one linear beam,
// because it is not proportional to the force: the tip moves by 17.95 um/N at 100 N, 15.61 at 200,
// 16.78 at 300, 17.47 at 400, 17.69 at 500 and 17.13 at 1000 N. The linear beam gives 18.66 at
// each.
#pragma once

#include <vector>

#include "firmware-like/beam/beam.h"

namespace plumbline::cli {

/// The plane of bending: the transverse axis of the flange frame F in which the points lie.
enum class BendingAxis { kX = 0, kY = 1 };

/// A point that moves with the beam: z along the beam, y across it [m], both unloaded.
struct BeamPoint {
  double z_m = 0;
  double y_m = 0;
};

/// Angle of each element [rad], from the root outwards.
///   theta_n = (delta_(n+1) - delta_n) / l,  delta_1 = 0                              (eq. 2)
/// The paper numbers nodes from 1; l is the length of the element.
std::vector<double> ElementAngles(const beam::BeamSolution& solution, BendingAxis axis);

/// The paper's compensated point, from the angle of the element e that contains it. Eq. 3 is
/// missing from the published text and is reconstructed from the sentences around it:
///   (z cos theta_e, y - z sin theta_e)
/// This rotates the point about the root. A node belongs to the element on its inboard side.
///
/// Eq. 3 is exact at the end of the first element only. Further out it applies the steeper angle of
/// an outer element over the whole length from the root and jumps at each node. More elements do
/// not help: at the tip, eq. 3 tends to the tip's slope times L, 1.5 times the displacement. It
/// also neglects that a point beside the axis rotates with its section: 0.55 mm along z for a point
/// 400 mm beside the axis at z = 1200 mm. At 100 N a point on the axis is shifted by
///
///   z mm   element   eq. 3, mm   section, mm   eq. 3 too large by
///    300      1       0.1382       0.0734           88 %
///    600      1       0.2765       0.2765            0
///    900      2       1.0368       0.5832           78 %
///   1200      2       1.3824       0.9677           43 %
///   1500      3       2.2464       1.4040           60 %
///   1800      3       2.6957       1.8662           44 %
BeamPoint CompensatedByElementAngle(const beam::BeamSolution& solution, BendingAxis axis,
                                    const BeamPoint& point);

/// Position of the point on the loaded beam, from the displacement d and rotation theta of its
/// section:
///   (z - y sin theta, d + y cos theta)
BeamPoint LoadedPoint(const beam::BeamSolution& solution, BendingAxis axis, const BeamPoint& point);

/// The point mirrored at its loaded position. If this point is commanded, the loaded point is on
/// target to first order in the deflection.
///   (z + y sin theta, 2 y - d - y cos theta)
BeamPoint CompensatedBySection(const beam::BeamSolution& solution, BendingAxis axis,
                               const BeamPoint& point);

/// The beam that reproduces Table 2: E = 200 GPa, nu = 0.3, 50 x 50 mm, 1800 mm long.
model::Tool PaperTool();
/// Number of elements of equal length in the paper's beam.
inline constexpr int kPaperElements = 3;

/// One row of Table 2: downward displacements of nodes 2, 3, 4 [mm].
struct PaperTable2Row {
  double force_N = 0;
  double developed_mm[3] = {};  ///< column "Direct Compensation applied AR system"
  double abaqus_mm[3] = {};     ///< column "Commercial FEM (Abaqus)"
};
const std::vector<PaperTable2Row>& PaperTable2();

/// Table 2 of the paper: this beam model next to the published columns "developed" and "Abaqus".
void PrintPaperTable2(std::ostream& out);

}  // namespace plumbline::cli
