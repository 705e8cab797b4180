// Validation of the beam against CalculiX: within 0.5 % of the tip displacement at every axis node.
//
// ccx has no beam theory of its own in these decks: B32R elements become C3D20R solids, so that the
// peer is three-dimensional elasticity. It is compared to Euler-Bernoulli where shear is below
// 0.1 % of the deflection, and to Timoshenko where it is not.
#include "tests/firmware-like/beam/calculix.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>

#include "tests/firmware-like/beam/beams.h"

namespace plumbline::calculix_test {

using namespace plumbline::beam;
using namespace plumbline::test;

namespace {

constexpr double kTolerance = 0.005;

/// CTest counts a test as skipped if its output contains SKIPPED.
bool Skip() {
  if (CalculixInstalled()) return false;
  std::puts("SKIPPED: ccx is not installed (Debian: calculix-ccx)");
  WARN("SKIPPED: ccx is not installed (Debian: calculix-ccx)");
  return true;
}

/// Largest difference at any node, relative to ccx's tip displacement.
double WorstDifference(const std::vector<AxisNode>& nodes, const BeamSolution& solution) {
  const double tip_m = nodes.back().d_F.norm();
  double worst = 0;
  for (const AxisNode& node : nodes) {
    // The beam does not stretch: d_z is not compared.
    const Vec3 difference = solution.At(node.z_m).d_F - node.d_F;
    worst = std::max(worst, std::hypot(difference.x(), difference.y()) / tip_m);
  }
  return worst;
}

double TipDifference(const std::vector<AxisNode>& nodes, const BeamSolution& solution) {
  return solution.Tip().d_F.head<2>().norm() / nodes.back().d_F.head<2>().norm() - 1;
}

void Compare(const char* what, const std::string& deck, const model::Tool& tool,
             const DeckLoad& load) {
  const BeamSolution solution = Beam(tool, 3).Solve(
      {.points = {{tool.Length(), load.tip_force_F, Vec3::Zero()}}, .g_F = load.g_F});
  const std::vector<AxisNode> nodes = SolveWithCalculix(deck);
  const double worst = WorstDifference(nodes, solution);
  std::printf("%-58s tip %+.2f %%, worst node %.2f %%\n", what,
              100 * TipDifference(nodes, solution), 100 * worst);
  CHECK(worst < kTolerance);
}

}  // namespace

TEST_CASE("beams of every section against rows of B32R elements") {
  if (Skip()) return;
  const model::Material paper_steel{200e9, 0.3, 7850};
  const model::Tool paper = BeamTool({{1.8, model::RectangleSection(0.05, 0.05), paper_steel}});
  const std::vector<DeckSegment> paper_deck{{1.8, "RECT", {0.05, 0.05}, paper_steel, 90}};
  const model::Tool skew = BeamTool({{1.2, model::RectangleSection(0.03, 0.05), kSteel}});
  const model::Tool stepped = BeamTool({{1.0, model::RectangleSection(0.06, 0.06), kSteel},
                                        {0.8, model::RectangleSection(0.04, 0.04), kAluminium}});
  const std::vector<DeckSegment> stepped_deck{{1.0, "RECT", {0.06, 0.06}, kSteel, 80},
                                              {0.8, "RECT", {0.04, 0.04}, kAluminium, 80}};
  const model::BeamTheory shear = model::BeamTheory::kTimoshenko;
  struct Case {
    const char* what;
    model::Tool tool;
    std::vector<DeckSegment> deck;
    DeckLoad load;
  };
  const Case cases[] = {
      {"paper's beam, 1800 x 50 x 50 mm, 100 N (Euler-Bernoulli)",
       paper,
       paper_deck,
       {.tip_force_F = {0, 100, 0}}},
      {"paper's beam, own weight (Euler-Bernoulli)", paper, paper_deck, {.g_F = {0, 9.80665, 0}}},
      {"30 x 50 mm, skew load and own weight (Euler-Bernoulli)",
       skew,
       {{1.2, "RECT", {0.03, 0.05}, kSteel, 90}},
       {{60, -150, 0}, {4, -8, 0}}},
      {"stepped beam of two materials, 200 N (Euler-Bernoulli)",
       stepped,
       stepped_deck,
       {.tip_force_F = {0, 200, 0}}},
      {"stepped beam, own weight (Euler-Bernoulli)",
       stepped,
       stepped_deck,
       {.g_F = {9.80665, 0, 0}}},
      {"square tube 60 x 4 mm, 500 N (Timoshenko)",
       BeamTool({{1.0, model::SquareTubeSection(0.06, 0.004), kSteel}}, shear),
       {{1.0, "BOX", {0.06, 0.06, 0.004, 0.004, 0.004, 0.004}, kSteel, 120}},
       {.tip_force_F = {0, 500, 0}}},
      {"tube 60 x 4 mm, 500 N (Timoshenko)",
       BeamTool({{1.5, model::TubeSection(0.06, 0.004, 0.3), kSteel}}, shear),
       {{1.5, "PIPE", {0.03, 0.004}, kSteel, 120}},
       {.tip_force_F = {0, 500, 0}}},
      {"ten heights long, 5 kN and own weight (Timoshenko)",
       BeamTool({{1.0, model::RectangleSection(0.06, 0.1), kSteel}}, shear),
       {{1.0, "RECT", {0.06, 0.1}, kSteel, 80}},
       {{0, 5000, 0}, {0, 9.80665, 0}}},
  };
  for (const Case& c : cases) {
    CAPTURE(c.what);
    Compare(c.what, BeamDeck(c.deck, c.load), c.tool, c.load);
  }
}

TEST_CASE("a beam five heights long, as a solid, needs Timoshenko's shear") {
  if (Skip()) return;
  const DeckLoad load{Vec3(0, 5000, 0), Vec3(0, 9.80665, 0)};
  const model::Section section = model::RectangleSection(0.06, 0.1);
  const std::string deck = SolidDeck(0.06, 0.1, 0.5, kSteel, {2, 4, 20}, load);
  const model::Tool thick = BeamTool({{0.5, section, kSteel}}, model::BeamTheory::kTimoshenko);
  Compare("solid C3D20R, L/h = 5, 5 kN (Timoshenko)", deck, thick, load);
  const model::Tool thin = BeamTool({{0.5, section, kSteel}});
  const BeamLoads loads{.points = {{0.5, load.tip_force_F, Vec3::Zero()}}, .g_F = load.g_F};
  CHECK(TipDifference(SolveWithCalculix(deck), Beam(thin, 3).Solve(loads)) < -0.02);
}

}  // namespace plumbline::calculix_test
