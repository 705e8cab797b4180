// Benchmark of a dense path: corrected poses a second, and the ratio to rigid inverse kinematics on
// the same poses in the same run.
#include <fmt/format.h>

#include <vector>

#include "app/programs/correction/path_corrector.h"
#include "firmware-like/kinematics/inverse.h"
#include "tests/bench/bench_timing.h"
#include "tests/bench/rows.h"
#include "tests/firmware-like/test_cell.h"

namespace {

using namespace plumbline;

/// A path of the tip as an offline programming system exports it: a pose about every
/// millimetre.
std::vector<Pose> PathOf(const deflection::LoadedArm& arm, std::size_t count) {
  std::vector<Pose> path;
  for (std::size_t k = 0; k < count; ++k) {
    const double t = static_cast<double>(k) * 7e-4;
    model::JointVector q(6);
    q << 0.3 + 0.4 * std::sin(t), 0.2 + 0.1 * std::sin(2 * t), -0.3 + 0.1 * std::cos(t),
        0.5 - 0.3 * std::sin(t), 0.9 + 0.1 * std::sin(3 * t), 0.2 + 0.3 * std::cos(t);
    path.push_back(arm.UnloadedTip(q));
  }
  return path;
}

model::JointVector StartOf() {
  model::JointVector q(6);
  q << 0.3, 0.2, -0.2, 0.5, 0.9, 0.5;
  return q;
}

/// Rigid inverse kinematics alone, each pose from the joints of the one before.
double RigidSeconds(const deflection::LoadedArm& arm, const std::vector<Pose>& path, double& sum) {
  model::JointVector q = StartOf();
  const double start_ms = bench::CpuTime_ms();
  for (const Pose& X_BT : path) {
    const auto tip = [&](const model::JointVector& theta, kinematics::Posture& posture) {
      arm.chain().Evaluate(theta, posture);
      return posture.X_BF() * arm.X_FT();
    };
    const auto outcome = kinematics::SolvePose(arm.chain(), {X_BT}, tip, 40, q);
    sum += outcome.residual_m + q[0];
  }
  return 1e-3 * (bench::CpuTime_ms() - start_ms);
}

double CorrectedSeconds(const model::CellModel& cell, const std::vector<Pose>& path, bool radius,
                        std::size_t& failed) {
  programs::PathCorrector corrector(cell, {}, {.radius = radius, .near_q = StartOf()});
  programs::PathRow row;
  row.payload = {60, *cell.payload_cog_F};
  programs::CorrectedRow corrected;
  const double start_ms = bench::CpuTime_ms();
  for (const Pose& X_BT : path) {
    row.X_BT = X_BT;
    corrector.Correct(row, corrected);
    failed += corrected.problem.empty() ? 0 : 1;
  }
  return 1e-3 * (bench::CpuTime_ms() - start_ms);
}

}  // namespace

int main(int argc, char** argv) {
  const bench::Effort effort = bench::EffortFrom(argc, argv);
  const model::CellModel cell = test::HeavyArm();
  const deflection::LoadedArm arm(cell);
  const std::vector<Pose> path =
      PathOf(arm, bench::Choose<std::size_t>(effort, 500, 20000, 100000));
  const double count = static_cast<double>(path.size());
  std::vector<double> rigid, with_radius, without;
  double sum = 0;
  std::size_t failed = 0;
  for (int round = 0; round < bench::Choose(effort, 1, 3, 7); ++round) {
    rigid.push_back(count / RigidSeconds(arm, path, sum));
    with_radius.push_back(count / CorrectedSeconds(cell, path, true, failed));
    without.push_back(count / CorrectedSeconds(cell, path, false, failed));
  }
  constexpr const char* kPeer = "rigid inverse kinematics from the pose before";
  bench::Report({.what = "poses of a path corrected, with their radii",
                 .ours = sum == 0 ? 0 : bench::Median(with_radius),
                 .unit = "1/s",
                 .goal = bench::RatioAtLeast(0.4),
                 .peer = kPeer,
                 .peers = bench::Median(rigid)});
  bench::Report({.what = "the same, goal by rate",
                 .ours = bench::Median(with_radius),
                 .unit = "1/s",
                 .goal = {"ours", ">=", 10000}});
  bench::Report({.what = "the same without radii", .ours = bench::Median(without), .unit = "1/s"});
  bench::Report({.what = "poses of the path without a correction",
                 .ours = static_cast<double>(failed),
                 .goal = bench::AtMost(0),
                 .timed = false});
  return 0;
}
