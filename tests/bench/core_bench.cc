// Benchmark of one correction and of a cycle with 100 points against rigid inverse kinematics in
// the same run, and of the heap allocations per cycle.
#include <fmt/core.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <new>

#include "drivers/plc/codec.h"
#include "firmware-like/kinematics/inverse.h"
#include "firmware-like/machine.h"
#include "tests/bench/bench_timing.h"
#include "tests/bench/rows.h"
#include "tests/firmware-like/test_cell.h"

namespace {

std::atomic<std::uint64_t> allocations{0};

}  // namespace

void* operator new(std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, std::align_val_t align) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  const auto alignment = static_cast<std::size_t>(align);
  if (void* memory =
          std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment)) {
    return memory;
  }
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  std::free(memory);
}

using namespace plumbline;

namespace {

double Now_us() {
  return 1e-3 * static_cast<double>(std::chrono::steady_clock::now().time_since_epoch() /
                                    std::chrono::nanoseconds(1));
}

constexpr const char* kLimit = "the control period";
constexpr double kPeriod_ms = 10;

struct Case {
  correction::AssemblyPoint point;
  model::JointVector taught;
};

/// Points across the cell that have a correction.
std::vector<Case> Cases(const model::CellModel& cell, const correction::Corrector& corrector,
                        std::size_t count) {
  std::mt19937 random(1);
  std::vector<Case> cases;
  while (cases.size() < count) {
    Case c;
    c.taught = test::RandomPosture(cell, random);
    c.point.id = static_cast<int>(cases.size()) + 1;
    c.point.near_q = c.taught;
    c.point.X_WP = cell.robot.X_WB * corrector.arm().UnloadedTip(c.taught);
    correction::Correction correction;
    corrector.Correct(c.point, {60, *cell.payload_cog_F}, {}, c.taught,
                      correction::BranchSearch::kNone, correction);
    if (correction.code == correction::CorrectionCode::kOk) cases.push_back(c);
  }
  return cases;
}

/// A fitted cell whose domain states all that a diagnosis can write.
model::CellModel FittedCell(std::mt19937& random) {
  model::CellModel cell = test::HeavyArm();
  model::Domain& domain = cell.domain.emplace();
  for (const model::Joint& joint : cell.robot.joints) domain.q.push_back({joint.min, joint.max});
  for (int k = 0; k < 48; ++k) domain.poses.push_back(test::RandomPosture(cell, random));
  domain.residual_sigma_m = 5e-5;
  domain.distant_sigma_m = 2e-4;
  domain.declared_sigma_m = 1e-3;
  domain.payload_kg = model::MeasuredRange{{{0, 0}, {20, 20}, {40, 40}}, 1e-5};
  domain.temp_C = model::MeasuredRange{{{20, 25}}, 1e-5};
  domain.t_s = model::MeasuredRange{{{0, 3600}}, 1e-8};
  for (int joint = 0; joint < cell.robot.size(); ++joint)
    domain.torques.push_back({joint, {{{-50, 200}}, 1e-6}});
  return cell;
}

/// What a point costs: its share of the correction, its variance, and whether it is extrapolated.
void ReportErrorGrowth(bench::Effort effort) {
  std::mt19937 random(2);
  const model::CellModel cell = FittedCell(random);
  const deflection::LoadedArm arm(cell);
  const loads::Payload payload{60, *cell.payload_cog_F};
  std::vector<deflection::OperatingPoint> points;
  for (int k = 0; k < 1000; ++k) {
    effects::Conditions moment;
    moment.temp_C = 27;
    moment.t_s = 7200;
    points.push_back(arm.PointAt(test::RandomPosture(cell, random), payload, moment));
  }
  std::vector<double> each;
  double sum = 0;
  const std::uint64_t before = allocations;
  each.reserve(200);
  const std::uint64_t reserved = allocations - before;
  for (int round = 0; round < bench::Choose(effort, 2, 50, 200); ++round) {
    const double start = Now_us();
    for (const deflection::OperatingPoint& at : points)
      sum +=
          arm.growth().Share(at) + arm.growth().Variance(at) + (arm.growth().Outside(at) ? 1 : 0);
    each.push_back((Now_us() - start) / static_cast<double>(points.size()));
  }
  const std::uint64_t allocated = allocations - before - reserved;
  bench::Report({.what = "predictive variance, share and range of a point",
                 .ours = sum > 0 ? bench::Median(each) : 0,
                 .unit = "us",
                 .goal = bench::AtMost(5)});
  bench::Report({.what = "heap allocations of these points",
                 .ours = static_cast<double>(allocated),
                 .goal = bench::AtMost(0),
                 .timed = false});
}

}  // namespace

int main(int argc, char** argv) {
  const bench::Effort effort = bench::EffortFrom(argc, argv);
  ReportErrorGrowth(effort);
  const model::CellModel cell = test::HeavyArm();
  const correction::Corrector corrector(cell, {});
  const loads::Payload payload{60, *cell.payload_cog_F};
  const std::vector<Case> cases = Cases(cell, corrector, 100);

  // Starts from the taught joints, as in the first cycle; rigid kinematics of our own solve the
  // same poses for a rigid arm from joints that are off by about the deflection.
  std::vector<double> ours, rigid;
  const deflection::LoadedArm& arm = corrector.arm();
  const auto rigid_tip = [&](const model::JointVector& q, kinematics::Posture& posture) {
    arm.chain().Evaluate(q, posture);
    return posture.X_BF() * arm.X_FT();
  };
  for (int round = 0; round < bench::Choose(effort, 2, 50, 200); ++round) {
    const double start = Now_us();
    for (const Case& c : cases) {
      correction::Correction correction;
      corrector.Correct(c.point, payload, {}, c.taught, correction::BranchSearch::kNone,
                        correction);
    }
    const double middle = Now_us();
    for (const Case& c : cases) {
      model::JointVector q = c.taught.array() + 3e-3;
      const Pose X_BT = cell.robot.X_WB.Inverse() * c.point.X_WP;
      if (!kinematics::SolvePose(arm.chain(), {X_BT}, rigid_tip, 40, q).converged) return 1;
    }
    ours.push_back((middle - start) / static_cast<double>(cases.size()));
    rigid.push_back((Now_us() - middle) / static_cast<double>(cases.size()));
  }
  bench::Report({.what = "one correction (6 joints, compliance, beam, inverse kinematics)",
                 .ours = bench::Median(ours),
                 .unit = "us",
                 .goal = bench::AtMost(20)});
  fmt::print("for comparison, our inverse kinematics of a rigid arm: {:.1f} us\n",
             bench::Median(rigid));

  MachineConfig config;
  config.cell = cell;
  std::vector<std::uint16_t> ids;
  for (const Case& c : cases) {
    config.points.push_back(c.point);
    ids.push_back(static_cast<std::uint16_t>(c.point.id));
  }
  Machine machine(config);
  machine.Prepare();
  plc::PlcEncoder encoder({}, ids);
  MachineInput input;
  input.robot.q = cases[0].taught;
  input.robot.payload_kg = 60;
  std::vector<double> cycles;
  cycles.reserve(2000);
  std::uint64_t allocated = 0;
  std::size_t valid = 0;
  for (int cycle = 0; cycle < 2000; ++cycle) {
    input.now_s = 100 + 0.01 * cycle;
    input.robot.timestamp_s = input.now_s;
    ++input.robot.sequence;
    input.robot.payload_kg = 55 + 5 * std::sin(0.01 * cycle);
    input.command.sequence = static_cast<std::uint16_t>(cycle / 10);
    input.command.code = model::PlcCommandCode::kCorrectPoint;
    input.command.point_id = static_cast<std::uint16_t>(1 + cycle / 10 % 100);
    const std::uint64_t before = allocations;
    const double start = bench::CpuTime_ms();
    const Snapshot& snapshot = machine.Cycle(input);
    encoder.Encode(snapshot, {});
    cycles.push_back(bench::CpuTime_ms() - start);
    if (cycle > 10) allocated += allocations - before;
    valid = static_cast<std::size_t>(std::count_if(snapshot.points.begin(), snapshot.points.end(),
                                                   [](const PointResult& p) { return p.valid; }));
  }
  const double worst = *std::max_element(cycles.begin() + 10, cycles.end());
  const auto cycle_row = [](const char* what, double ms) {
    bench::Report({.what = what,
                   .ours = ms,
                   .unit = "ms",
                   .goal = bench::RatioAtMost(0.2),
                   .peer = kLimit,
                   .peers = kPeriod_ms});
  };
  cycle_row("a cycle with 100 points, median CPU time", bench::Median(cycles));
  cycle_row("a cycle with 100 points, longest CPU time", worst);
  std::vector<double> idle;
  for (int cycle = 0; cycle < 1000; ++cycle) {
    input.now_s += 0.01;
    input.robot.timestamp_s = input.now_s;
    ++input.robot.sequence;
    const double start = bench::CpuTime_ms();
    encoder.Encode(machine.Cycle(input), {});
    idle.push_back(bench::CpuTime_ms() - start);
  }
  cycle_row("a cycle with 100 points, nothing changes", bench::Median(idle));
  bench::Report({.what = "heap allocations in 1989 cycles",
                 .ours = static_cast<double>(allocated),
                 .goal = bench::AtMost(0),
                 .timed = false});
  bench::Report({.what = "points of 100 that are not valid in the last cycle",
                 .ours = 100.0 - static_cast<double>(valid),
                 .goal = bench::AtMost(0),
                 .timed = false});
  return 0;
}
