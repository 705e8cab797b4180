// Reference solutions by CalculiX (ccx): writes a beam as an Abaqus deck, solves it, reads the
// result.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "tests/firmware-like/beam/beams.h"

namespace plumbline::test {

/// A segment of the beam, which ccx expands into solid elements.
struct DeckSegment {
  double length_m = 0;
  std::string section;             ///< "RECT", "BOX" or "PIPE"
  std::vector<double> dimensions;  ///< of *BEAM SECTION [m]
  model::Material material;
  int elements = 0;
};

struct DeckLoad {
  Vec3 tip_force_F = Vec3::Zero();
  Vec3 g_F = Vec3::Zero();  ///< zero: no self-weight
};

/// A row of B32R beam elements along z with all six degrees of freedom of the root fixed.
std::string BeamDeck(const std::vector<DeckSegment>& segments, const DeckLoad& load);

/// A block of C3D20R solid elements, b along x, h along y, the tip force spread over the face
/// z = length. The face z = 0 stays plane and does not slide, but is free to contract across, as
/// beam theory has it; BeamDeck's root is not, which stiffens it. `elements` counts along x, y, z;
/// the first two are even, so that there are nodes on the axis.
std::string SolidDeck(double b_m, double h_m, double length_m, const model::Material& material,
                      const std::array<int, 3>& elements, const DeckLoad& load);

/// A node on the beam's axis.
struct AxisNode {
  double z_m = 0;
  Vec3 d_F = Vec3::Zero();
};

/// True if `ccx` can be run.
bool CalculixInstalled();

/// Solves a deck in a temporary directory, which is removed, and reads the displacements of the
/// nodes in its set AXIS. Throws std::runtime_error with the output of ccx if there are none.
std::vector<AxisNode> SolveWithCalculix(const std::string& deck);

}  // namespace plumbline::test
