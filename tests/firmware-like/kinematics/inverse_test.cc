#include "firmware-like/kinematics/inverse.h"

#include <Eigen/SVD>
#include <catch2/catch.hpp>

#include "tests/firmware-like/test_cell.h"

namespace plumbline::inverse_test {

using namespace plumbline::kinematics;

namespace {

auto FlangeOf(const Chain& chain) {
  return [&chain](const model::JointVector& q, Posture& posture) {
    chain.Evaluate(q, posture);
    return posture.X_BF();
  };
}

}  // namespace

TEST_CASE("a pose is recovered from a nearby seed, on the same branch") {
  std::mt19937 random(5);
  const model::CellModel cell = test::HeavyArm();
  const Chain chain(cell.robot);
  for (int trial = 0; trial < 200; ++trial) {
    const model::JointVector truth = test::RandomPosture(cell, random);
    Posture posture;
    chain.Evaluate(truth, posture);
    Jacobian jacobian;
    chain.JacobianAt(posture, posture.X_BF().p, jacobian);
    if (SmallestSingularValue(jacobian, 6) < 0.02) continue;  // two branches meet there
    model::JointVector seed = truth;
    for (double& value : seed) value += std::uniform_real_distribution(-0.05, 0.05)(random);
    model::JointVector q;
    InverseOutcome outcome;
    const BranchOutcome found =
        SolvePoseOnNearestBranch(chain, {posture.X_BF()}, FlangeOf(chain), 4, seed, q, outcome);
    REQUIRE(found == BranchOutcome::kFound);
    CHECK((q - truth).cwiseAbs().maxCoeff() < 1e-6);
  }
}

TEST_CASE("a pose within limits is found from a distant seed") {
  std::mt19937 random(6);
  const model::CellModel cell = test::HeavyArm();
  const Chain chain(cell.robot);
  int found = 0;
  constexpr int kTrials = 200;
  for (int trial = 0; trial < kTrials; ++trial) {
    Posture posture;
    chain.Evaluate(test::RandomPosture(cell, random), posture);
    model::JointVector q;
    InverseOutcome outcome;
    if (SolvePoseOnNearestBranch(chain, {posture.X_BF()}, FlangeOf(chain), 64,
                                 test::RandomPosture(cell, random), q,
                                 outcome) != BranchOutcome::kFound) {
      continue;
    }
    ++found;
    CHECK(chain.WithinLimits(q));
    Posture reached;
    chain.Evaluate(q, reached);
    CHECK((reached.X_BF().p - posture.X_BF().p).norm() < 1e-8);
  }
  CHECK(found == kTrials);
}

TEST_CASE("of two branches within the limits, the nearer one is selected") {
  const model::CellModel cell = test::HeavyArm();
  const Chain chain(cell.robot);
  model::JointVector one(6);
  one << 0.2, 0.3, -0.4, 0.5, 0.8, -0.3;
  model::JointVector other = one;  // the same pose with the wrist turned over
  other[3] += std::numbers::pi;
  other[4] = -other[4];
  other[5] += std::numbers::pi;
  Posture posture;
  chain.Evaluate(one, posture);
  for (const model::JointVector& seed : {one, other}) {
    model::JointVector q;
    InverseOutcome outcome;
    REQUIRE(SolvePoseOnNearestBranch(chain, {posture.X_BF()}, FlangeOf(chain), 16, seed, q,
                                     outcome) == BranchOutcome::kFound);
    CHECK((q - seed).cwiseAbs().maxCoeff() < 1e-6);
  }
}

TEST_CASE("coupled axes: the readings of a pose are found, whole turns and limits included") {
  std::mt19937 random(9);
  model::CellModel cell = test::HeavyArm();
  cell.robot.couplings = {{2, 1, 1.0}, {4, 3, 0.25}, {5, 4, -0.5}};
  const Chain chain(cell.robot);
  int found = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const model::JointVector truth = test::RandomPosture(cell, random);
    Posture posture;
    chain.Evaluate(truth, posture);
    model::JointVector seed = test::RandomPosture(cell, random), q;
    if (trial % 2 == 0) seed = truth + 0.05 * model::JointVector::Random(6);
    InverseOutcome outcome;
    if (SolvePoseOnNearestBranch(chain, {posture.X_BF()}, FlangeOf(chain), 64, seed, q, outcome) !=
        BranchOutcome::kFound) {
      continue;
    }
    ++found;
    CHECK(chain.WithinLimits(q));
    Posture reached;
    chain.Evaluate(q, reached);
    CHECK((reached.X_BF().p - posture.X_BF().p).norm() < 1e-8);
    CHECK((reached.X_BF().R - posture.X_BF().R).norm() < 1e-8);
  }
  CHECK(found >= 95);
}

TEST_CASE("a whole turn of a joint turns those coupled to it back") {
  model::CellModel cell = test::HeavyArm();
  cell.robot.couplings = {{5, 4, 0.2}, {4, 3, 0.5}};
  const Chain chain(cell.robot);
  model::JointVector seed(6), turned(6);
  seed << 0.1, 0.2, 0.3, -1.0, 0.5, 0.6;
  turned = seed;
  turned[3] += 2 * std::numbers::pi;
  turned[4] -= 0.5 * 2 * std::numbers::pi;
  turned[5] += 0.2 * 0.5 * 2 * std::numbers::pi;
  Posture one, other;
  chain.Evaluate(seed, one);
  chain.Evaluate(turned, other);
  REQUIRE((one.X_BF().R - other.X_BF().R).norm() < 1e-12);
  CHECK(WrapIntoLimits(chain, seed, turned));
  CHECK((turned - seed).norm() < 1e-12);
}

TEST_CASE("redundant arms and arms with a prismatic axis are solved too") {
  std::mt19937 random(7);
  model::CellModel cell = test::HeavyArm();
  model::Joint rail;
  rail.type = model::JointType::kPrismatic;
  rail.alpha_rad = 0.5 * std::numbers::pi;
  rail.min = -2;
  rail.max = 2;
  cell.robot.joints.insert(cell.robot.joints.begin(), rail);
  const Chain chain(cell.robot);
  for (int trial = 0; trial < 50; ++trial) {
    const model::JointVector truth = test::RandomPosture(cell, random);
    Posture posture;
    chain.Evaluate(truth, posture);
    model::JointVector q = truth + 0.1 * model::JointVector::Random(7);
    const InverseOutcome outcome = SolvePose(chain, {posture.X_BF()}, FlangeOf(chain), 60, q);
    CHECK(outcome.converged);
  }
}

TEST_CASE("the search terminates without a solution for a pose out of reach") {
  const model::CellModel cell = test::HeavyArm();
  const Chain chain(cell.robot);
  Pose far;
  far.p = Vec3(20, 0, 0);
  model::JointVector q;
  InverseOutcome outcome;
  CHECK(SolvePoseOnNearestBranch(chain, {far}, FlangeOf(chain), 16, model::JointVector::Zero(6), q,
                                 outcome) == BranchOutcome::kNone);
}

TEST_CASE("the singular value bound lies between sigma_min / sqrt(6) and sigma_min") {
  std::mt19937 random(8);
  const model::CellModel cell = test::HeavyArm();
  const Chain chain(cell.robot);
  for (int trial = 0; trial < 100; ++trial) {
    Posture posture;
    chain.Evaluate(test::RandomPosture(cell, random), posture);
    Jacobian jacobian;
    chain.JacobianAt(posture, posture.X_BF().p, jacobian);
    const double sigma =
        Eigen::JacobiSVD<Eigen::Matrix<double, 6, 6>>(jacobian).singularValues()[5];
    const double bound = SmallestSingularValue(jacobian, 6);
    CHECK(bound <= sigma * (1 + 1e-6));
    CHECK(bound >= sigma / std::sqrt(6.0) * (1 - 1e-6));
  }
}

}  // namespace plumbline::inverse_test
