#include "app/cli/beam_paper.h"

#include <catch2/catch.hpp>
#include <cmath>

namespace plumbline::beam_paper_test {

using namespace plumbline::cli;

namespace {

beam::BeamSolution PaperBeam(const model::Tool& tool, double force_N) {
  return beam::Beam(tool, kPaperElements)
      .Solve({.points = {{tool.Length(), Vec3(0, force_N, 0), Vec3::Zero()}}});
}

double TipMm(const model::Tool& tool, double force_N) {
  return 1e3 * PaperBeam(tool, force_N).Tip().d_F.y();
}

}  // namespace

TEST_CASE("the eighteen values of column 'developed system' in Table 2 are reproduced") {
  int values = 0;
  for (const PaperTable2Row& row : PaperTable2()) {
    const beam::BeamSolution solution = PaperBeam(PaperTool(), row.force_N);
    for (int node = 1; node <= 3; ++node, ++values) {
      const double printed_mm = row.developed_mm[node - 1];
      // One unit in the last printed digit: the paper truncated some values instead of rounding.
      const double last_digit_mm = printed_mm > 10 ? 1e-3 : 1e-4;
      CAPTURE(row.force_N, node);
      CHECK(std::abs(1e3 * solution.Node(node).d_F.y() - printed_mm) <= last_digit_mm);
    }
  }
  CHECK(values == 18);
}

TEST_CASE("the parameters printed in the paper do not reproduce its table") {
  model::Tool printed = PaperTool();
  printed.segments[0].length_m = 0.6;
  printed.segments[0].material.youngs_modulus_Pa = 2e9;
  const beam::BeamSolution solution = PaperBeam(printed, 100);
  CHECK(1e3 * solution.Node(1).d_F.y() == Approx(1.024).margin(5e-4));
  CHECK(1e3 * solution.Node(2).d_F.y() == Approx(3.584).margin(5e-4));
  CHECK(1e3 * solution.Node(3).d_F.y() == Approx(6.912).margin(5e-4));
  CHECK(1e3 * solution.Tip().d_F.y() / PaperTable2()[0].developed_mm[2] ==
        Approx(3.70).margin(0.01));
}

TEST_CASE("the finite-element column of the paper is not proportional to the force") {
  double lowest = 1e9, highest = 0;
  for (const PaperTable2Row& row : PaperTable2()) {
    const double compliance = row.abaqus_mm[2] / row.force_N;
    lowest = std::min(lowest, compliance);
    highest = std::max(highest, compliance);
    CHECK(TipMm(PaperTool(), row.force_N) / row.force_N == Approx(0.0186624));
  }
  CHECK(highest / lowest > 1.14);  // 15 % apart at one node
  CHECK(highest / lowest < 1.16);
}

TEST_CASE("element angles follow eq. 2") {
  const std::vector<double> theta = ElementAngles(PaperBeam(PaperTool(), 100), BendingAxis::kY);
  REQUIRE(theta.size() == 3);
  CHECK(theta[0] == Approx(0.27648 / 600));
  CHECK(theta[1] == Approx((0.96768 - 0.27648) / 600));
  CHECK(theta[2] == Approx((1.86624 - 0.96768) / 600));
}

TEST_CASE("the paper's compensation overshoots that of the section, as tabulated in beam_paper.h") {
  const beam::BeamSolution solution = PaperBeam(PaperTool(), 100);
  struct Case {
    double z_mm, paper_mm, section_mm, excess;
  };
  // At nodes 2, 3, 4 and in the middle of each element; excess = paper / section - 1.
  const Case cases[] = {
      {300, 0.13824, 0.07344, 0.882},  {600, 0.27648, 0.27648, 0.000},
      {900, 1.03680, 0.58320, 0.778},  {1200, 1.38240, 0.96768, 0.429},
      {1500, 2.24640, 1.40400, 0.600}, {1800, 2.69568, 1.86624, 0.444},
  };
  for (const Case& c : cases) {
    CAPTURE(c.z_mm);
    const BeamPoint point{c.z_mm / 1e3, 0};
    const double paper_mm = -1e3 * CompensatedByElementAngle(solution, BendingAxis::kY, point).y_m;
    const double section_mm = -1e3 * CompensatedBySection(solution, BendingAxis::kY, point).y_m;
    CHECK(paper_mm == Approx(c.paper_mm).margin(1e-5));
    CHECK(section_mm == Approx(c.section_mm).margin(1e-5));
    CHECK(paper_mm / section_mm - 1 == Approx(c.excess).margin(1e-3));
  }
}

TEST_CASE("a point beside the axis rotates with its section") {
  const beam::BeamSolution solution = PaperBeam(PaperTool(), 100);
  const BeamPoint point{1.2, 0.4};
  const double theta = 100 * 1.2 * (2 * 1.8 - 1.2) / (2 * 200e9 * std::pow(0.05, 4) / 12);
  const BeamPoint loaded = LoadedPoint(solution, BendingAxis::kY, point);
  CHECK(loaded.z_m == Approx(1.2 - 0.4 * std::sin(theta)).epsilon(1e-9));
  CHECK(loaded.y_m == Approx(0.4 * std::cos(theta) + 0.96768e-3).epsilon(1e-9));
  const BeamPoint command = CompensatedBySection(solution, BendingAxis::kY, point);
  CHECK(command.z_m > 1.2);
  CHECK(command.y_m < 0.4);
  SECTION("the paper's rule neglects this rotation") {
    const BeamPoint paper = CompensatedByElementAngle(solution, BendingAxis::kY, point);
    CHECK(paper.z_m < 1.2);
    CHECK(std::abs(paper.z_m - 1.2) < 1e-6);
    CHECK(command.z_m - 1.2 == Approx(0.4 * std::sin(theta)));  // 0.55 mm
    CHECK(command.z_m - 1.2 > 0.5e-3);
  }
}

TEST_CASE("bending along x is compensated in the same way as bending along y") {
  const model::Tool tool = PaperTool();
  const beam::BeamSolution along_x =
      beam::Beam(tool, 3).Solve({.points = {{1.8, Vec3(100, 0, 0), Vec3::Zero()}}});
  const beam::BeamSolution along_y = PaperBeam(tool, 100);
  const BeamPoint point{1.0, 0.2};
  CHECK(LoadedPoint(along_x, BendingAxis::kX, point).z_m ==
        Approx(LoadedPoint(along_y, BendingAxis::kY, point).z_m));
  CHECK(CompensatedByElementAngle(along_x, BendingAxis::kX, point).y_m ==
        Approx(CompensatedByElementAngle(along_y, BendingAxis::kY, point).y_m));
}

}  // namespace plumbline::beam_paper_test
