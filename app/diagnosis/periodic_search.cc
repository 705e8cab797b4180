#include "app/diagnosis/periodic_search.h"

#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "app/diagnosis/shape_gain.h"
#include "firmware-like/effects/counterbalance.h"
#include "firmware-like/effects/gear_periodic.h"

namespace plumbline::diagnosis {
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
  Block block = SineAndCosine(effects::GearPeriodic(), joint, kParameterCount, {0, cycles, 0});
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

/// Products over the rows for computing the gain of a line. The free frames are already projected
/// out of the residual.
class JointRows {
 public:
  JointRows(const LinearProblem& problem, int joint, const Eigen::VectorXd& residual)
      : q(SignalAtRows(problem, [joint](const effects::Conditions& m) { return m.q[joint]; })),
        along(q.size()),
        square(q.size()),
        along_frames_(q.size(), problem.frames().cols()) {
    const Eigen::VectorXd& turn = problem.Carrier(joint);
    for (const FitRowIndex j : problem.rows().indices()) {
      const auto of_row = problem.layout().PartOf(turn, j);
      along[j.value()] = of_row.col(0).dot(problem.layout().PartOf(residual, j).col(0));
      square[j.value()] = of_row.squaredNorm();
      if (along_frames_.cols() == 0) continue;
      along_frames_.row(j.value()) =
          of_row.transpose() * problem.layout().PartOf(problem.frames(), j);
    }
    if (along_frames_.cols() < kManyFrames) return;
    sparse_along_frames_ = along_frames_.sparseView();  // a place has columns at its own rows only
    along_frames_.resize(q.size(), 0);
  }

  /// Reduction of chi2 by a line, with the free frames projected out; equal to Gain() of its sine
  /// and cosine.
  double GainOf(double cycles) const {
    Eigen::MatrixX2d factors(q.size(), 2);
    factors.col(0) = (cycles * q).array().sin();
    factors.col(1) = (cycles * q).array().cos();
    Eigen::Matrix2d gram = factors.transpose() * (square.asDiagonal() * factors);
    if (along_frames_.cols() > 0) {
      const Eigen::MatrixX2d in_frames = along_frames_.transpose() * factors;
      gram -= in_frames.transpose() * in_frames;
    } else if (sparse_along_frames_.cols() > 0) {
      const Eigen::MatrixX2d in_frames = sparse_along_frames_.transpose() * factors;
      gram -= in_frames.transpose() * in_frames;
    }
    const Eigen::Vector2d moment = factors.transpose() * along;
    gram.diagonal().array() += 1e-9 * gram.diagonal().maxCoeff() + 1e-300;
    return moment.dot(gram.ldlt().solve(moment));
  }

  Eigen::VectorXd q;
  Eigen::VectorXd along, square;  ///< carrier times residual, squared carrier

 private:
  static constexpr Eigen::Index kManyFrames = 40;

  Eigen::MatrixXd along_frames_;  ///< carrier times the nuisances' basis, shape (rows, rank)
  /// The same where the basis has many columns, most of them zero at most rows.
  Eigen::SparseMatrix<double> sparse_along_frames_;
};

constexpr double kMinCycles = 0.5, kMaxCycles = 400;
constexpr double kMinSpan_rad = 0.05;  // minimum range of a joint for separating lines
/// Cycles per turn of an eccentric and of an elliptical gear: lines that need no search.
constexpr std::array kWholeCycles = {1.0, 2.0};
constexpr double kStepsPerResolution = 3;  // loses at most 9 % of the gain before refinement

/// Spectral resolution, in cycles per turn, of a joint with this range.
double ResolutionOf(double span_rad) {
  return 2 * std::numbers::pi / span_rad;
}

/// Sums over the rows of weight sin(c q) and weight cos(c q), shape (steps, 2), for equally spaced
/// cycles c. Sine and cosine of each row are advanced by the angle addition formulas, a few rows at
/// a time so that they remain in the cache.
Eigen::ArrayX2d LineSums(const Eigen::VectorXd& q, const Eigen::VectorXd& weight, double first,
                         double step, Eigen::Index steps) {
  constexpr Eigen::Index kAtOnce = 256;
  Eigen::ArrayX2d sums = Eigen::ArrayX2d::Zero(steps, 2);
  for (Eigen::Index from = 0; from < q.size(); from += kAtOnce) {
    const Eigen::Index count = std::min(kAtOnce, q.size() - from);
    const auto angle = q.segment(from, count).array();
    const Eigen::ArrayXd w = weight.segment(from, count).array();
    const Eigen::ArrayXd turn_cos = (step * angle).cos(), turn_sin = (step * angle).sin();
    Eigen::ArrayXd c = w * (first * angle).cos(), s = w * (first * angle).sin(), next(count);
    for (Eigen::Index k = 0; k < steps; ++k) {
      sums(k, 0) += s.sum();
      sums(k, 1) += c.sum();
      next = c * turn_cos - s * turn_sin;
      s = s * turn_cos + c * turn_sin;
      c.swap(next);
    }
  }
  return sums;
}

/// Gains of sine and cosine at equally spaced cycles, free frames not projected out.
std::vector<double> GainsAlong(const LinearProblem& problem, const JointRows& rows, int joint,
                               double step) {
  const auto steps = static_cast<Eigen::Index>(kMaxCycles / step);
  const Eigen::ArrayX2d along = LineSums(rows.q, rows.along, kMinCycles, step, steps);
  // sin^2, cos^2 and sin cos from the sine and cosine of the double angle.
  const Eigen::ArrayX2d& twice = problem.CachedForJoint(
      joint, [&] { return LineSums(rows.q, rows.square, 2 * kMinCycles, 2 * step, steps); });
  const double total = rows.square.sum();
  std::vector<double> gains;
  gains.reserve(static_cast<std::size_t>(steps));
  for (Eigen::Index k = 0; k < steps; ++k) {
    const double bs = along(k, 0), bc = along(k, 1), sc = twice(k, 0) / 2;
    const double cc = (total + twice(k, 1)) / 2, ss = total - cc;
    const double det = ss * cc - sc * sc;
    gains.push_back(det > 1e-9 * ss * cc ? (bs * bs * cc - 2 * bs * bc * sc + bc * bc * ss) / det
                                         : 0);
  }
  return gains;
}

using Peak = PeriodicLine;

bool Higher(const Peak& a, const Peak& b) {
  return a.gain > b.gain;
}

/// The highest local maxima.
std::vector<Peak> PeaksOf(const std::vector<double>& gains, int joint, double step) {
  constexpr std::size_t kMaxPeaks = 4;
  std::vector<Peak> peaks;
  for (std::size_t s = 0; s < gains.size(); ++s) {
    const bool rises = s == 0 || gains[s] >= gains[s - 1];
    const bool falls = s + 1 == gains.size() || gains[s] >= gains[s + 1];
    if (rises && falls)
      peaks.push_back({joint, kMinCycles + step * static_cast<double>(s), gains[s], 0});
  }
  std::sort(peaks.begin(), peaks.end(), Higher);
  if (peaks.size() > kMaxPeaks) peaks.resize(kMaxPeaks);
  return peaks;
}

/// The strongest lines of one joint, located to a third of the resolution, free frames not
/// projected out; empty if the joint hardly moved.
/// @param trials  receives the number of lines that can be resolved; unchanged if there are none
std::vector<Peak> PeriodicPeaks(const LinearProblem& problem, const JointRows& rows, int joint,
                                double& trials) {
  const double span = problem.JointSpan(joint);
  if (!(span > kMinSpan_rad)) return {};
  const double resolution = ResolutionOf(span);
  trials = kMaxCycles / resolution * 2;
  const double step = resolution / kStepsPerResolution;
  return PeaksOf(GainsAlong(problem, rows, joint, step), joint, step);
}

/// The spectral window of the rows, |sum_i w_i exp(i c q_i)| / sum_i w_i with the squared carrier
/// as weight: 1 at the cycles c that a line may gain or lose without changing at any row.
Eigen::ArrayXd SpectralWindow(const JointRows& rows, double first, double step,
                              Eigen::Index steps) {
  const Eigen::ArrayX2d sums = LineSums(rows.q, rows.square, first, step, steps);
  return sums.square().rowwise().sum().sqrt() / std::max(rows.square.sum(), 1e-300);
}

/// The maxima of the spectral window at which lines cannot be distinguished, beyond the resolution
/// of the range itself.
std::vector<double> IndistinctShifts(const JointRows& rows, double resolution) {
  // A line at such a shift leaves at most 1 - 0.97^2 = 6 % of the chi2 that the true one explains;
  // whether that rules it out is for its refit to decide.
  constexpr double kIndistinct = 0.97, kStepsOfWindow = 12;
  constexpr int kRefinement = 16;
  const double step = resolution / kStepsOfWindow, first = 2 * resolution;
  const auto steps = static_cast<Eigen::Index>((2 * kMaxCycles - first) / step);
  if (steps < 3) return {};
  const Eigen::ArrayXd window = SpectralWindow(rows, first, step, steps);
  std::vector<double> shifts;
  for (Eigen::Index k = 1; k + 1 < steps; ++k) {
    if (window[k] < window[k - 1] || window[k] < window[k + 1] || window[k] < 0.9) continue;
    const double fine = step / kRefinement, from = first + step * static_cast<double>(k) - step;
    Eigen::Index at = 0;
    const double highest = SpectralWindow(rows, from, fine, 2 * kRefinement + 1).maxCoeff(&at);
    if (highest >= kIndistinct) shifts.push_back(from + fine * static_cast<double>(at));
  }
  return shifts;
}

/// Refines the cycles of a line, with the free frames projected out.
Peak Refined(const LinearProblem& problem, const JointRows& rows, Peak peak) {
  constexpr int kHalvings = 6;
  const int joint = peak.joint;
  peak.gain = rows.GainOf(peak.cycles_per_turn);
  double width = ResolutionOf(problem.JointSpan(joint)) / kStepsPerResolution;
  for (int halving = 0; halving < kHalvings; ++halving, width /= 2) {
    for (const double side : {-1.0, 1.0}) {
      const double cycles = peak.cycles_per_turn + side * width / 2;
      if (cycles < kMinCycles || cycles > kMaxCycles) continue;
      const double gain = rows.GainOf(cycles);
      if (gain > peak.gain) peak = {joint, cycles, gain, 0};
    }
  }
  // A line of amplitude A has the gain A^2 sum |J|^2 / 2.
  peak.amplitude_rad = std::sqrt(2 * peak.gain) / problem.Carrier(joint).norm();
  return peak;
}

/// Number of lines with whole cycles over all joints, among which one is selected.
double WholeLines(int joints) {
  return static_cast<double>(kWholeCycles.size()) * joints;
}

class PeriodicSearch final : public ShapeSearch {
 public:
  std::vector<Block> Propose(const LinearProblem& problem,
                             const Eigen::VectorXd& residual) const override {
    Found found, eccentric;
    std::vector<Peak> coarse;
    double trials = 1;
    const int joints = problem.data().cell.robot.size();
    std::vector<JointRows> rows;
    for (int joint = 0; joint < joints; ++joint) {
      double of_joint = 1;
      rows.emplace_back(problem, joint, residual);
      const std::vector<Peak> peaks = PeriodicPeaks(problem, rows.back(), joint, of_joint);
      coarse.insert(coarse.end(), peaks.begin(), peaks.end());
      if (of_joint == 1) continue;  // it hardly moved
      for (const double whole : kWholeCycles) {
        eccentric.emplace_back(rows.back().GainOf(whole),
                               PeriodicBlock(joint, whole, WholeLines(joints)));
      }
      trials += of_joint;
    }
    constexpr std::size_t kRefined = 12, kKept = 3;
    std::stable_sort(coarse.begin(), coarse.end(), Higher);
    for (std::size_t k = 0; k < std::min(kRefined, coarse.size()); ++k) {
      const JointRows& of_joint = rows[static_cast<std::size_t>(coarse[k].joint)];
      const Peak peak = Refined(problem, of_joint, coarse[k]);
      found.emplace_back(peak.gain, PeriodicBlock(peak.joint, peak.cycles_per_turn, 1));
    }
    std::vector<Block> blocks = Best(std::move(eccentric), kKept);
    for (Block& block : Best(std::move(found), kKept)) {
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
      if (!effects::IsCycles(specs[static_cast<std::size_t>(parameter.spec)])) continue;
      const double cycles = effect.values[k];
      const bool whole = cycles == std::round(cycles);
      blocks.push_back(PeriodicBlock(parameter.joint, cycles,
                                     whole ? WholeLines(data.cell.robot.size()) : kTrials));
    }
    return blocks;
  }

  std::vector<Block> AllPlacements(const Dataset& data) const override {
    std::vector<Block> blocks;
    for (int joint = 0; joint < data.cell.robot.size(); ++joint) {
      for (const double cycles : kWholeCycles) blocks.push_back(PeriodicBlock(joint, cycles, 1));
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
    return {SineAndCosine(effects::Counterbalance(), kCounterbalancedJoint, 2, {0, 0})};
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
  const double resolution =
      2 * std::numbers::pi / std::max(kMinSpan_rad, problem.JointSpan(a.joint));
  return std::abs(a.cycles_per_turn - b.cycles_per_turn) < kMinSeparation * resolution;
}

std::vector<double> AliasedCycles(const LinearProblem& problem, const PeriodicLine& line) {
  const double span = problem.JointSpan(line.joint);
  if (!(span > kMinSpan_rad)) return {};
  const JointRows rows(problem, line.joint, problem.response());
  std::vector<double> cycles;
  for (const double shift : IndistinctShifts(rows, ResolutionOf(span))) {
    for (const double other :
         {std::abs(shift - line.cycles_per_turn), shift + line.cycles_per_turn}) {
      if (other >= kMinCycles && other <= kMaxCycles) cycles.push_back(other);
    }
  }
  std::sort(cycles.begin(), cycles.end());
  return cycles;
}

Block LineAt(const Block& line, double cycles) {
  const PeriodicLine of = LineOf(line).value();
  return PeriodicBlock(of.joint, cycles, line.trials);
}

std::vector<PeriodicLine> PeriodicLines(const LinearProblem& problem,
                                        const Eigen::VectorXd& residual) {
  std::vector<PeriodicLine> lines;
  constexpr double kLargestLine_rad = 2e-3,
                   kMinSignal = 5;  // of a gear; signal over all rows in sigma
  for (int joint = 0; joint < problem.data().cell.robot.size(); ++joint) {
    if (kLargestLine_rad * problem.Carrier(joint).norm() < kMinSignal) continue;  // no lever arm
    double trials = 1;
    const JointRows rows(problem, joint, residual);
    for (const Peak& peak : PeriodicPeaks(problem, rows, joint, trials)) {
      lines.push_back(Refined(problem, rows, peak));
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

}  // namespace plumbline::diagnosis
