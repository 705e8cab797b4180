// The compensation of an assembly point as the paper does it, beside that of the section itself.
//
// Park & Park, "Development of a Software Based Calibration System for Automobile Assembly System
// Oriented AR", DAAAM International Scientific Book 2012, ch. 44. README.md tells the difference.
#pragma once

#include <vector>

#include "firmware-like/beam/beam.h"

namespace plumbline {

/// The plane of bending: the transverse axis of F in which the points lie.
enum class BendingAxis { kX = 0, kY = 1 };

/// A point of the assembly that moves with the beam: z along it, y across it [m], unloaded.
struct BeamPoint {
  double z_m = 0;
  double y_m = 0;
};

/// Angle of each element [rad], from the root.
///   theta_n = (delta_(n+1) - delta_n) / l,  delta_1 = 0                              (eq. 2)
/// delta counts nodes from 1 there; l is that element's length.
std::vector<double> ElementAngles(const BeamSolution& solution, BendingAxis axis);

/// The paper's compensated point, by the angle of the element e in which it lies (eq. 3, lost in
/// the published text; from the sentences around it):
///   (z cos theta_e, y - z sin theta_e)
/// It turns the point about the root. A node belongs to the element inboard of it.
BeamPoint CompensatedByElementAngle(const BeamSolution& solution, BendingAxis axis,
                                    const BeamPoint& point);

/// Where the loaded beam carries the point: with displacement d and rotation theta of its section,
///   (z - y sin theta, d + y cos theta)
BeamPoint LoadedPoint(const BeamSolution& solution, BendingAxis axis, const BeamPoint& point);

/// The point mirrored at its loaded place: commanded there, it lands where it was wanted, to first
/// order in the deflection.
///   (z + y sin theta, 2 y - d - y cos theta)
BeamPoint CompensatedBySection(const BeamSolution& solution, BendingAxis axis,
                               const BeamPoint& point);

/// The beam of the paper's Table 2, as it computes: E = 200 GPa, nu = 0.3, a square of 50 x 50 mm,
/// three elements of 600 mm. Printed are E = 2 GPa and 600 mm.
Tool PaperTool();
inline constexpr int kPaperElements = 3;

/// One line of the paper's Table 2: displacements of nodes 2, 3, 4 [mm], downwards.
struct PaperTable2Row {
  double force_N = 0;
  double developed_mm[3] = {};  ///< "Direct Compensation applied AR system"
  double abaqus_mm[3] = {};     ///< "Commercial FEM (Abaqus)"
};
const std::vector<PaperTable2Row>& PaperTable2();

}  // namespace plumbline
