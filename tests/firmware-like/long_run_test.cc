// Long-run tests: wrap-around of counters, and a month of simulated time. The clock is
// an input, so a month takes seconds.
#include <catch2/catch.hpp>

#include "firmware-like/machine.h"
#include "tests/firmware-like/test_cell.h"

namespace plumbline::long_run_test {

namespace {

constexpr double kMonth_s = 30.0 * 86400;

/// A machine with one point and a robot that is read in each cycle.
struct LongRun {
  Machine machine;
  MachineInput input;

  LongRun() : machine(Config()) {
    machine.Prepare();
    input.robot.q = Taught();
    input.robot.payload_kg = 60;
    input.probes_recorded = true;
  }
  static model::JointVector Taught() {
    model::JointVector q(6);
    q << 0.2, 0.4, 0.3, 0.5, 0.8, -0.4;
    return q;
  }
  static MachineConfig Config() {
    MachineConfig config;
    config.cell = test::HeavyArm();
    correction::AssemblyPoint point;
    point.id = 7;
    point.near_q = Taught();
    point.X_WP = config.cell.robot.X_WB * deflection::LoadedArm(config.cell).UnloadedTip(Taught());
    config.points = {point};
    return config;
  }
  const Snapshot& Cycle(double period_s) {
    input.now_s += period_s;
    input.utc_s += period_s;
    input.robot.timestamp_s = input.now_s;
    ++input.robot.sequence;
    // Alternate between two loads, so that the correction is recomputed.
    input.robot.payload_kg = input.robot.sequence % 2 == 0 ? 60.0 : 60.001;
    return machine.Cycle(input);
  }
};

}  // namespace

TEST_CASE("16-bit and 32-bit counters wrap around without losing a cycle") {
  LongRun run;
  run.input.now_s = 4294967.0;                    // milliseconds pass 2^32
  run.input.robot.sequence = 4294967296 - 40000;  // so do the readings
  for (int k = 0; k < 5; ++k) run.Cycle(0.01);
  std::uint16_t last = run.Cycle(0.01).points[0].sequence;
  const Vec3 first = run.Cycle(0.01).points[0].correction.translation_B;
  ++last;
  std::uint16_t command = 65500;
  int executed = 0, probes = 0;
  deflection::LoadedState state;
  const deflection::LoadedArm arm(run.machine.config().cell);
  REQUIRE(arm.AtCommanded(run.input.robot.q, {60, *run.machine.config().cell.payload_cog_F}, {},
                          state));
  const Vec3 tip_W = state.p_read_W;
  for (int k = 0; k < 70000; ++k) {
    if (k % 500 == 0) {  // 140 commands, through 65535 and 0
      run.input.command.code = model::PlcCommandCode::kProbe;
      run.input.command.probe_W = tip_W;
      run.input.command.sequence = ++command;
    }
    const Snapshot& snapshot = run.Cycle(0.01);
    probes += snapshot.probe_taken;
    executed += snapshot.result.sequence == command &&
                snapshot.result.code == correction::CorrectionCode::kOk;
    REQUIRE(snapshot.points[0].valid);
    REQUIRE(snapshot.points[0].sequence == static_cast<std::uint16_t>(last + 1));
    REQUIRE(snapshot.alarms == 0);
    last = snapshot.points[0].sequence;
  }
  CHECK(executed == 70000);
  CHECK(probes == 140);
  run.Cycle(0.01);  // the other load
  CHECK(run.Cycle(0.01).points[0].correction.translation_B.isApprox(first, 1e-9));
}

TEST_CASE("correction, radius and trust are unchanged after a month") {
  LongRun run;
  for (int k = 0; k < 5; ++k) run.Cycle(0.01);
  const PointResult before = run.Cycle(0.01).points[0];
  REQUIRE(before.valid);
  constexpr int kCycles = 100'000;
  for (int k = 0; k < kCycles; ++k) {
    const Snapshot& snapshot = run.Cycle(kMonth_s / kCycles);
    REQUIRE(snapshot.points[0].valid);
    REQUIRE(snapshot.alarms == 0);
  }
  run.Cycle(0.01);  // the other load
  const PointResult after = run.Cycle(0.01).points[0];
  CHECK(after.correction.translation_B.isApprox(before.correction.translation_B, 1e-9));
  CHECK(after.correction.q.isApprox(before.correction.q, 1e-9));
  CHECK(after.correction.uncertainty_m == Approx(before.correction.uncertainty_m).epsilon(1e-9));

  // Staleness is still detected within its limit.
  for (int k = 0; k < 11; ++k) {
    run.input.now_s += 0.01;
    run.machine.Cycle(run.input);
  }
  run.input.now_s += 0.01;
  CHECK_FALSE(run.machine.Cycle(run.input).points[0].valid);
}

}  // namespace plumbline::long_run_test
