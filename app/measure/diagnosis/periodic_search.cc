#include "app/measure/diagnosis/periodic_search.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "app/measure/diagnosis/joint_lines.h"
#include "app/measure/diagnosis/shape_gain.h"
#include "firmware-like/effects/catalogue.h"

namespace plumbline::measure {
namespace {

constexpr int kCounterbalancedJoint = 1;  // q2 carries the spring or gas cylinder of heavy arms
enum GearParameter { kAmplitude, kCycles, kPhase, kParameterCount };

/// Block of amplitude sin(cycles q + phase) with a sine and a cosine column; the phase is the last
/// parameter.
Block SineAndCosine(const effects::Effect& effect, int joint, int parameters,
                    std::vector<double> values) {
  Block block;
  block.term.effect = &effect;
  block.id = effect.traits().id;
  for (int spec = 0; spec < parameters; ++spec) block.term.parameters.push_back({spec, joint});
  for (const double angle : {0.0, std::numbers::pi / 2}) {
    BlockColumn& column = block.columns.emplace_back();
    values.back() = angle;
    column.values = values;
    column.plausible = PlausibleSizes(effect.traits(), kAmplitude);
  }
  return block;
}

Block PeriodicBlock(int joint, double cycles, double trials) {
  static const effects::Effect& gear_periodic = *effects::FindEffect("gear_periodic");
  Block block = SineAndCosine(gear_periodic, joint, kParameterCount, {0, cycles, 0});
  block.trials = trials;
  return block;
}

/// The effect with the amplitude and phase of a fitted sine and cosine.
effects::ActiveEffect AmplitudeAndPhase(const Block& block, const ColumnSizes& values) {
  const auto sine = values.find(BlockColumnIndex(0)), cosine = values.find(BlockColumnIndex(1));
  const double a = sine == values.end() ? 0 : sine->second;
  const double b = cosine == values.end() ? 0 : cosine->second;
  effects::ActiveEffect effect;
  effect.term = block.term;
  effect.values = block.columns.front().values;
  effect.values.front() = std::hypot(a, b);
  effect.values.back() = std::atan2(b, a);
  return effect;
}

/// Number of lines with whole cycles over all joints, among which one is selected.
double WholeLines(int joints) {
  return static_cast<double>(JointLines::kWholeCycles.size()) * joints;
}

/// A joint's residual, and its strongest lines.
struct ScannedJoint {
  const JointLines& lines;
  Eigen::VectorXd along;
  std::vector<PeriodicLine> peaks;

  ScannedJoint(const LinearProblem& problem, int joint, const Eigen::VectorXd& residual)
      : lines(JointLines::Of(problem, joint)),
        along(lines.Along(residual)),
        peaks(lines.Peaks(along)) {}
};

/// The strongest of the peaks after refinement. Only those are refined that can become one of them.
Found StrongestLines(const std::vector<ScannedJoint>& joints, std::size_t most) {
  constexpr std::size_t kCompared = 12;
  const auto higher = [](const PeriodicLine& a, const PeriodicLine& b) { return a.gain > b.gain; };
  const auto scan_of = [&](const PeriodicLine& line) -> const ScannedJoint& {
    return joints[line.joint];
  };
  std::vector<PeriodicLine> lines;
  for (const ScannedJoint& joint : joints) {
    lines.insert(lines.end(), joint.peaks.begin(), joint.peaks.end());
  }
  std::ranges::stable_sort(lines, higher);
  if (lines.size() > kCompared) lines.resize(kCompared);
  for (PeriodicLine& line : lines) line = scan_of(line).lines.WithGain(line, scan_of(line).along);
  std::ranges::stable_sort(lines, higher);
  Found found;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    const double least = lines[std::min(k, most - 1)].gain;
    if (lines[k].gain < (1 - JointLines::kLostByScan) * least) break;
    const PeriodicLine line = scan_of(lines[k]).lines.Refined(lines[k], scan_of(lines[k]).along);
    found.emplace_back(line.gain, PeriodicBlock(line.joint, line.cycles_per_turn, 1));
  }
  return found;
}

class PeriodicSearch final : public ShapeSearch {
 public:
  std::vector<Block> Propose(const LinearProblem& problem,
                             const Eigen::VectorXd& residual) const override {
    constexpr std::size_t kKept = 3;
    const int count = problem.data().cell.robot.size();
    std::vector<ScannedJoint> joints;
    Found eccentric;
    double trials = 1;
    for (int joint = 0; joint < count; ++joint) {
      const ScannedJoint& scanned = joints.emplace_back(problem, joint, residual);
      if (!scanned.lines.moved()) continue;
      for (std::size_t k = 0; k < JointLines::kWholeCycles.size(); ++k) {
        eccentric.emplace_back(
            scanned.lines.GainOfWhole(k, scanned.along),
            PeriodicBlock(joint, JointLines::kWholeCycles[k], WholeLines(count)));
      }
      trials += scanned.lines.resolvable();
    }
    std::vector<Block> blocks = Best(std::move(eccentric), kKept);
    for (Block& block : Best(StrongestLines(joints, kKept), kKept)) {
      block.trials = trials;
      blocks.push_back(std::move(block));
    }
    return blocks;
  }

  std::vector<Block> Refitted(const Dataset& data,
                              const effects::ActiveEffect& effect) const override {
    constexpr double kTrials = 5000;  // effective number for the search over all joints and cycles
    std::vector<Block> blocks;
    const auto& specs = effect.term.effect->traits().parameters;
    for (std::size_t k = 0; k < effect.values.size(); ++k) {
      const effects::TermParameter& parameter = effect.term.parameters[k];
      if (!effects::IsCycles(specs[parameter.spec])) continue;
      const double cycles = effect.values[k];
      const bool whole = cycles == std::round(cycles);
      blocks.push_back(PeriodicBlock(parameter.joint, cycles,
                                     whole ? WholeLines(data.cell.robot.size()) : kTrials));
    }
    return blocks;
  }

  std::optional<Eigen::MatrixXd> Columns(const LinearProblem& problem,
                                         const Block& block) const override {
    const PeriodicLine line = LineOf(block).value();
    const Eigen::ArrayXd angle =
        line.cycles_per_turn *
        SignalAtRows(problem, [&](const effects::Conditions& m) { return m.q[line.joint]; });
    Eigen::MatrixXd waves(angle.size(), block.columns.count());
    for (const BlockColumnIndex k : block.columns.indices()) {
      waves.col(k.value()) = (angle + block.columns[k].values.back()).sin();
    }
    return problem.Carried({line.joint}, waves);
  }

  std::vector<Block> AllPlacements(const Dataset& data) const override {
    std::vector<Block> blocks;
    for (int joint = 0; joint < data.cell.robot.size(); ++joint) {
      for (const double cycles : JointLines::kWholeCycles)
        blocks.push_back(PeriodicBlock(joint, cycles, 1));
    }
    return blocks;
  }

  effects::ActiveEffect EffectFrom(const Block& block, const ColumnSizes& values) const override {
    return AmplitudeAndPhase(block, values);
  }

  bool JoinsBlocks() const override { return true; }

  /// A second line of a joint gets the specs of "q#_#_amplitude".
  void Join(const effects::ActiveEffect& more, effects::ActiveEffect& effect) const override {
    const int joint = more.term.parameters.front().joint;
    int harmonic = 1;
    for (const effects::TermParameter& parameter : effect.term.parameters) {
      if (parameter.joint == joint) harmonic = std::max(harmonic, parameter.harmonic + 1);
    }
    for (std::size_t k = 0; k < more.values.size(); ++k) {
      effects::TermParameter parameter = more.term.parameters[k];
      parameter.harmonic = harmonic;
      if (harmonic > 1) parameter.spec += kParameterCount;
      effect.term.parameters.push_back(parameter);
      effect.values.push_back(more.values[k]);
    }
  }

  bool Excludes(const LinearProblem& problem,
                std::span<const Block* const> support) const override {
    std::vector<PeriodicLine> lines;
    for (const Block* block : support) {
      if (const auto line = LineOf(*block)) lines.push_back(*line);
    }
    for (std::size_t a = 0; a < lines.size(); ++a) {
      for (std::size_t b = a + 1; b < lines.size(); ++b) {
        if (Unresolved(problem, lines[a], lines[b])) return true;
      }
    }
    return false;
  }
};

class BalanceSearch final : public ShapeSearch {
 public:
  bool DependsOnResidual() const override { return false; }
  std::vector<Block> Fixed(const Dataset& data) const override {
    if (data.cell.robot.size() <= kCounterbalancedJoint) return {};
    return {
        SineAndCosine(*effects::FindEffect("counterbalance"), kCounterbalancedJoint, 2, {0, 0})};
  }
  effects::ActiveEffect EffectFrom(const Block& block, const ColumnSizes& values) const override {
    return AmplitudeAndPhase(block, values);
  }
};

}  // namespace

bool Unresolved(const LinearProblem& problem, const PeriodicLine& a, const PeriodicLine& b) {
  if (a.joint != b.joint) return false;
  const auto whole = [](double cycles) { return cycles == std::round(cycles); };
  if (whole(a.cycles_per_turn) && whole(b.cycles_per_turn)) return false;
  constexpr double kMinSeparation = 0.7;
  const double resolution = JointLines::ResolutionOf(problem.JointSpan(a.joint));
  return std::abs(a.cycles_per_turn - b.cycles_per_turn) < kMinSeparation * resolution;
}

std::vector<double> AliasedCycles(const LinearProblem& problem, const PeriodicLine& line) {
  std::vector<double> cycles;
  for (const double shift : JointLines::Of(problem, line.joint).IndistinctShifts()) {
    for (const double other :
         {std::abs(shift - line.cycles_per_turn), shift + line.cycles_per_turn}) {
      if (other >= JointLines::kMinCycles && other <= JointLines::kMaxCycles) {
        cycles.push_back(other);
      }
    }
  }
  std::ranges::sort(cycles);
  return cycles;
}

Block LineAt(const Block& line, double cycles) {
  const PeriodicLine periodic = LineOf(line).value();
  return PeriodicBlock(periodic.joint, cycles, line.trials);
}

std::vector<PeriodicLine> PeriodicLines(const LinearProblem& problem,
                                        const Eigen::VectorXd& residual) {
  std::vector<PeriodicLine> lines;
  constexpr double kLargestLine_rad = 2e-3,
                   kMinSignal = 5;  // of a gear; signal over all rows in sigma
  for (int joint = 0; joint < problem.data().cell.robot.size(); ++joint) {
    if (kLargestLine_rad * problem.Carrier(joint).norm() < kMinSignal) continue;  // no lever arm
    const ScannedJoint scanned(problem, joint, residual);
    for (const PeriodicLine& peak : scanned.peaks) {
      lines.push_back(
          scanned.lines.Refined(scanned.lines.WithGain(peak, scanned.along), scanned.along));
    }
  }
  return lines;
}

const ShapeSearch& GearPeriodicSearch() {
  static const PeriodicSearch search;
  return search;
}

const ShapeSearch& CounterbalanceSearch() {
  static const BalanceSearch search;
  return search;
}

}  // namespace plumbline::measure
