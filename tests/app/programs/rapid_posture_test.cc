// Postures of RAPID on an arm whose posture is known by construction.
#include "app/programs/brands/rapid_posture.h"

#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "app/base/config/cell_reader.h"
#include "app/programs/brands/rapid.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/kinematics/inverse.h"

namespace rapid_posture_test {

using namespace plumbline;
using namespace plumbline::programs;

namespace {

kinematics::Chain Irb4600() {
  config::FaultList faults;
  const auto cell = config::ReadCell("config/cells/irb4600-60-205.toml", faults);
  REQUIRE(cell);
  return kinematics::Chain(cell->robot);
}

model::JointVector Degrees(const std::vector<double>& degrees) {
  model::JointVector q(6);
  for (int i = 0; i < 6; ++i) q[i] = degrees[static_cast<std::size_t>(i)] * kRadPerDeg;
  return q;
}

Configuration Confdata(const std::vector<std::string>& texts) {
  const char* const keys[] = {"cf1", "cf4", "cf6", "cfx"};
  Configuration stated;
  for (std::size_t i = 0; i < 4; ++i) stated.fields.push_back({keys[i], {}, texts[i]});
  return stated;
}

bool Agree(const std::vector<std::string>& texts, const std::vector<double>& degrees) {
  return Rapid().Agrees(Confdata(texts), Irb4600(), Degrees(degrees), MotionKind::kJoint);
}

}  // namespace

TEST_CASE("cfx counts the sides of axis 1, of the lower arm and of axis 5") {
  const kinematics::Chain chain = Irb4600();
  // In front: upright, or leaning forward. Behind axis 1: leaning far back. Behind the lower arm:
  // the upper arm folded over.
  CHECK(rapid::CfxOf(chain, Degrees({0, 0, 0, 0, 30, 0})) == 0);
  CHECK(rapid::CfxOf(chain, Degrees({0, 0, 0, 0, -30, 0})) == 1);
  CHECK(rapid::CfxOf(chain, Degrees({50, 60, -150, 0, 30, 0})) == 2);
  CHECK(rapid::CfxOf(chain, Degrees({120, -80, 0, 10, 30, 0})) == 4);
  CHECK(rapid::CfxOf(chain, Degrees({120, -80, -120, 10, -30, 0})) == 7);
}

TEST_CASE("quarter turns of axes 1, 4 and 6 are obeyed, also on their limits") {
  CHECK(Agree({"0", "-1", "1", "0"}, {10, 20, 10, -10, 30, 100}));
  CHECK_FALSE(Agree({"-1", "-1", "1", "0"}, {10, 20, 10, -10, 30, 100}));
  CHECK_FALSE(Agree({"0", "0", "1", "0"}, {10, 20, 10, -10, 30, 100}));
  CHECK_FALSE(Agree({"0", "-1", "-3", "0"}, {10, 20, 10, -10, 30, 100}));
  CHECK(Agree({"0", "-1", "1", "0"}, {-0.01, 20, 10, 0.01, 30, 100}));
  CHECK(Agree({"0", "-1", "-3", "0"}, {10, 20, 10, -10, 30, -260}));
}

TEST_CASE("a cfx of another definition counts if the quarter turns decide alone") {
  // The flipped wrist has other quarters of axes 4 and 6.
  CHECK(Agree({"0", "-1", "1", "4"}, {10, 20, 10, -10, 30, 100}));
}

TEST_CASE("a cfx that the definition gives to another posture of these quarters decides") {
  const kinematics::Chain chain = Irb4600();
  // Both elbows reach this flange pose with axes 1, 4 and 6 in the same quarters.
  const model::JointVector q = Degrees({10, 20, -20, 5, 40, 20});
  kinematics::Posture posture;
  chain.Evaluate(q, posture);
  const kinematics::PoseTarget target{posture.X_BF()};
  const auto flange = [&](const model::JointVector& theta, kinematics::Posture& at) {
    chain.Evaluate(theta, at);
    return at.X_BF();
  };
  const int mine = *rapid::CfxOf(chain, q);
  int others = 0;
  for (int start = 0; start < 24; ++start) {
    model::JointVector other = kinematics::RestartPosture(chain, q, start);
    if (!kinematics::SolvePose(chain, target, flange, 60, other).converged) continue;
    kinematics::WrapIntoLimits(chain, q, other);
    const auto in_first = [&](int joint) {
      return other[joint] > 0 && other[joint] < 90 * kRadPerDeg;
    };
    const int cfx = *rapid::CfxOf(chain, other);
    if (cfx == mine || !in_first(0) || !in_first(3) || !in_first(5)) continue;
    ++others;
    const Configuration stated = Confdata({"0", "0", "0", std::to_string(cfx)});
    CHECK(rapid::AgreesWithConfdata(stated, chain, other));
    CHECK_FALSE(rapid::AgreesWithConfdata(stated, chain, q));
  }
  CHECK(others > 0);
  CHECK(rapid::AgreesWithConfdata(Confdata({"0", "0", "0", std::to_string(mine)}), chain, q));
}

TEST_CASE("confdata changes only where the posture has left it") {
  const kinematics::Chain chain = Irb4600();
  const auto texts = [&](const std::vector<std::string>& stated, const std::vector<double>& q) {
    return Rapid().ConfigurationOf(Confdata(stated), chain, Degrees(q));
  };
  using Texts = std::vector<std::string>;
  CHECK(texts({"0", "-1.0", "1", "0"}, {10, 20, 10, -10, 30, 100}) == Texts{"0", "-1.0", "1", "0"});
  CHECK(texts({"0", "-1", "1", "0"}, {-1, 20, 10, -10, 30, 89}) == Texts{"-1", "-1", "0", "0"});
}

}  // namespace rapid_posture_test
