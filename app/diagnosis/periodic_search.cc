#include "app/diagnosis/periodic_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "app/diagnosis/shape_gain.h"
#include "firmware-like/effects/counterbalance.h"
#include "firmware-like/effects/gear_periodic.h"

namespace plumbline {
namespace {

constexpr int kCounterbalancedJoint = 1;  // q2 carries the spring or gas cylinder of heavy arms
enum GearParameter { kAmplitude, kCycles, kPhase, kOfOneTerm };

/// amplitude sin(cycles q + phase) as a sine and a cosine; the phase is the last parameter.
Block TwoPhases(const Effect& effect, int joint, int parameters, std::vector<double> values) {
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
  Block block = TwoPhases(GearPeriodic(), joint, kOfOneTerm, {0, cycles, 0});
  block.trials = trials;
  return block;
}

/// Amplitude and phase of a sine and a cosine.
ActiveEffect OnePhase(const Block& block, const ColumnSizes& values) {
  const auto sine = values.find(BlockColumnIndex(0)), cosine = values.find(BlockColumnIndex(1));
  const double a = sine == values.end() ? 0 : sine->second;
  const double b = cosine == values.end() ? 0 : cosine->second;
  ActiveEffect effect;
  effect.term = block.term;
  effect.values = block.columns.front().values;
  effect.values.front() = std::hypot(a, b);
  effect.values.back() = std::atan2(b, a);
  return effect;
}

double PeriodicGain(const LinearProblem& problem, int joint, double cycles,
                    const Eigen::VectorXd& residual) {
  const Eigen::VectorXd angle =
      cycles * AtRows(problem, [joint](const Conditions& m) { return m.q[joint]; });
  Eigen::MatrixXd factors(angle.size(), 2);
  factors.col(0) = angle.array().sin();
  factors.col(1) = angle.array().cos();
  return Gain(problem, problem.Carried({joint}, factors), residual);
}

/// Sums over rows that the gain of a line needs.
struct JointRows {
  Eigen::VectorXd q;
  Eigen::VectorXd along, square;  ///< carrier times residual, carrier times itself

  JointRows(const LinearProblem& problem, int joint, const Eigen::VectorXd& residual)
      : q(AtRows(problem, [joint](const Conditions& m) { return m.q[joint]; })),
        along(q.size()),
        square(q.size()) {
    const Eigen::VectorXd& turn = problem.Carrier(joint);
    for (const FitRowIndex j : problem.rows().indices()) {
      const auto of_row = problem.layout().PartOf(turn, j);
      along[j.value()] = of_row.col(0).dot(problem.layout().PartOf(residual, j).col(0));
      square[j.value()] = of_row.squaredNorm();
    }
  }
};

constexpr double kFewestCycles = 0.5, kMostCycles = 400;
constexpr double kLeastSpan_rad = 0.05;  // of a joint, for lines to be told apart
/// Cycles a turn of an eccentric and of an oval wheel: lines that need no search.
constexpr std::array kWhole = {1.0, 2.0};
constexpr double kStepsOfLobe = 3;  // 9 % of a gain lost at most, before it is refined

/// Width of a line in cycles per turn, of a joint that moved by so much.
double LobeOf(double span_rad) {
  return 2 * std::numbers::pi / span_rad;
}

/// Gains of sin and cos at cycles that rise by a step, the frames not taken out. Sine and cosine of
/// every row are turned on from step to step, by the addition theorems.
std::vector<double> GainsAlong(const JointRows& rows, double step) {
  const auto steps = static_cast<int>(kMostCycles / step);
  using Rows = Eigen::ArrayXd;
  const Rows q = rows.q, along = rows.along, square = rows.square;
  const Rows turn_cos = (step * q).cos(), turn_sin = (step * q).sin();
  Rows c = (kFewestCycles * q).cos(), s = (kFewestCycles * q).sin(), next(q.size());
  const double total = square.sum();
  std::vector<double> gains;
  gains.reserve(static_cast<std::size_t>(steps));
  for (int k = 0; k < steps; ++k) {
    const double bs = (along * s).sum(), bc = (along * c).sum();
    const double cc = (square * c * c).sum(), sc = (square * s * c).sum(), ss = total - cc;
    const double det = ss * cc - sc * sc;
    gains.push_back(det > 1e-9 * ss * cc ? (bs * bs * cc - 2 * bs * bc * sc + bc * bc * ss) / det
                                         : 0);
    next = c * turn_cos - s * turn_sin;
    s = s * turn_cos + c * turn_sin;
    c.swap(next);
  }
  return gains;
}

using Peak = PeriodicLine;

bool Higher(const Peak& a, const Peak& b) {
  return a.gain > b.gain;
}

/// The highest local maxima.
std::vector<Peak> PeaksOf(const std::vector<double>& gains, int joint, double step) {
  constexpr std::size_t kMostPeaks = 4;
  std::vector<Peak> peaks;
  for (std::size_t s = 0; s < gains.size(); ++s) {
    const bool rises = s == 0 || gains[s] >= gains[s - 1];
    const bool falls = s + 1 == gains.size() || gains[s] >= gains[s + 1];
    if (rises && falls)
      peaks.push_back({joint, kFewestCycles + step * static_cast<double>(s), gains[s], 0});
  }
  std::sort(peaks.begin(), peaks.end(), Higher);
  if (peaks.size() > kMostPeaks) peaks.resize(kMostPeaks);
  return peaks;
}

/// The strongest lines of one joint, to a third of a line's width and the free frames not taken
/// out; none where the joint hardly moved.
/// @param trials  lines that can be told apart; unchanged where there are none
std::vector<Peak> PeriodicPeaks(const LinearProblem& problem, int joint,
                                const Eigen::VectorXd& residual, double& trials) {
  const double span = problem.JointSpan(joint);
  if (!(span > kLeastSpan_rad)) return {};
  const double lobe = LobeOf(span);
  trials = kMostCycles / lobe * 2;
  const double step = lobe / kStepsOfLobe;
  return PeaksOf(GainsAlong(JointRows(problem, joint, residual), step), joint, step);
}

/// The line at its exact cycles, the frames taken out.
Peak Refined(const LinearProblem& problem, const Eigen::VectorXd& residual, Peak peak) {
  constexpr int kHalvings = 6;
  const int joint = peak.joint;
  const auto exact = [&](double cycles) { return PeriodicGain(problem, joint, cycles, residual); };
  peak.gain = exact(peak.cycles_per_turn);
  double width = LobeOf(problem.JointSpan(joint)) / kStepsOfLobe;
  for (int halving = 0; halving < kHalvings; ++halving, width /= 2) {
    for (const double side : {-1.0, 1.0}) {
      const double cycles = peak.cycles_per_turn + side * width / 2;
      if (cycles < kFewestCycles || cycles > kMostCycles) continue;
      const double gain = exact(cycles);
      if (gain > peak.gain) peak = {joint, cycles, gain, 0};
    }
  }
  // A line of amplitude A has the gain A^2 sum |J|^2 / 2.
  peak.amplitude_rad = std::sqrt(2 * peak.gain) / problem.Carrier(joint).norm();
  return peak;
}

/// True where two lines of one joint stand nearer than its range can tell apart; whole cycles are
/// an eccentricity and its harmonics, not a line in two halves.
bool TooNear(const LinearProblem& problem, const PeriodicLine& a, const PeriodicLine& b) {
  if (a.joint != b.joint) return false;
  const auto whole = [](double cycles) { return cycles == std::round(cycles); };
  if (whole(a.cycles_per_turn) && whole(b.cycles_per_turn)) return false;
  constexpr double kLobes = 0.7;
  const double lobe = 2 * std::numbers::pi / std::max(kLeastSpan_rad, problem.JointSpan(a.joint));
  return std::abs(a.cycles_per_turn - b.cycles_per_turn) < kLobes * lobe;
}

/// Whole lines of all joints, among which one is chosen.
double WholeLines(int joints) {
  return static_cast<double>(kWhole.size()) * joints;
}

class PeriodicSearch final : public ShapeSearch {
 public:
  std::vector<Block> Propose(const LinearProblem& problem,
                             const Eigen::VectorXd& residual) const override {
    Found found, eccentric;
    std::vector<Peak> coarse;
    double trials = 1;
    const int joints = problem.data().cell.robot.size();
    for (int joint = 0; joint < joints; ++joint) {
      double of_joint = 1;
      const std::vector<Peak> peaks = PeriodicPeaks(problem, joint, residual, of_joint);
      coarse.insert(coarse.end(), peaks.begin(), peaks.end());
      if (of_joint == 1) continue;  // it never moved far
      for (const double whole : kWhole) {
        eccentric.emplace_back(PeriodicGain(problem, joint, whole, residual),
                               PeriodicBlock(joint, whole, WholeLines(joints)));
      }
      trials += of_joint;
    }
    constexpr std::size_t kRefined = 12, kKept = 3;
    std::stable_sort(coarse.begin(), coarse.end(), Higher);
    for (std::size_t k = 0; k < std::min(kRefined, coarse.size()); ++k) {
      const Peak peak = Refined(problem, residual, coarse[k]);
      found.emplace_back(peak.gain, PeriodicBlock(peak.joint, peak.cycles_per_turn, 1));
    }
    std::vector<Block> blocks = Best(std::move(eccentric), kKept);
    for (Block& block : Best(std::move(found), kKept)) {
      block.trials = trials;
      blocks.push_back(std::move(block));
    }
    return blocks;
  }

  std::vector<Block> Refitted(const Dataset& data, const ActiveEffect& effect) const override {
    constexpr double kTrials = 5000;  // as many as the search of all joints and cycles
    std::vector<Block> blocks;
    const auto& specs = effect.term.effect->traits().parameters;
    for (std::size_t k = 0; k < effect.values.size(); ++k) {
      const TermParameter& parameter = effect.term.parameters[k];
      if (!IsCycles(specs[static_cast<std::size_t>(parameter.spec)])) continue;
      const double cycles = effect.values[k];
      const bool whole = cycles == std::round(cycles);
      blocks.push_back(PeriodicBlock(parameter.joint, cycles,
                                     whole ? WholeLines(data.cell.robot.size()) : kTrials));
    }
    return blocks;
  }

  std::vector<Block> Everywhere(const Dataset& data) const override {
    std::vector<Block> blocks;
    for (int joint = 0; joint < data.cell.robot.size(); ++joint) {
      for (const double cycles : kWhole) blocks.push_back(PeriodicBlock(joint, cycles, 1));
    }
    return blocks;
  }

  ActiveEffect EffectFrom(const Block& block, const ColumnSizes& values) const override {
    return OnePhase(block, values);
  }

  bool SeveralInOne() const override { return true; }

  /// A second line of a joint gets the specs of "q#_#_amplitude".
  void Join(const ActiveEffect& more, ActiveEffect& effect) const override {
    const int joint = more.term.parameters.front().joint;
    int harmonic = 1;
    for (const TermParameter& parameter : effect.term.parameters) {
      if (parameter.joint == joint) harmonic = std::max(harmonic, parameter.harmonic + 1);
    }
    for (std::size_t k = 0; k < more.values.size(); ++k) {
      TermParameter parameter = more.term.parameters[k];
      parameter.harmonic = harmonic;
      if (harmonic > 1) parameter.spec += kOfOneTerm;
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
        if (TooNear(problem, lines[a], lines[b])) return true;
      }
    }
    return false;
  }
};

class BalanceSearch final : public ShapeSearch {
 public:
  bool FollowsResidual() const override { return false; }
  std::vector<Block> Fixed(const Dataset& data) const override {
    if (data.cell.robot.size() <= kCounterbalancedJoint) return {};
    return {TwoPhases(Counterbalance(), kCounterbalancedJoint, 2, {0, 0})};
  }
  ActiveEffect EffectFrom(const Block& block, const ColumnSizes& values) const override {
    return OnePhase(block, values);
  }
};

}  // namespace

std::vector<PeriodicLine> PeriodicLines(const LinearProblem& problem,
                                        const Eigen::VectorXd& residual) {
  std::vector<PeriodicLine> lines;
  constexpr double kLargestLine_rad = 2e-3, kLeastSeen = 5;  // of a gear; sigma over all rows
  for (int joint = 0; joint < problem.data().cell.robot.size(); ++joint) {
    if (kLargestLine_rad * problem.Carrier(joint).norm() < kLeastSeen) continue;  // no lever
    double trials = 1;
    for (const Peak& peak : PeriodicPeaks(problem, joint, residual, trials)) {
      lines.push_back(Refined(problem, residual, peak));
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

}  // namespace plumbline
