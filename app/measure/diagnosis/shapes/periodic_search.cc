#include "app/measure/diagnosis/shapes/periodic_search.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>

#include "app/measure/diagnosis/shapes/shape_gain.h"
#include "firmware-like/effects/catalogue.h"

namespace plumbline::measure {
LineSums::LineSums(const Eigen::VectorXd& q, double first, double step, Eigen::Index steps)
    : steps_(steps), start_(static_cast<std::size_t>(q.size())), spread_(2 * kSpread, q.size()) {
  constexpr int kLeastGrid = 4 * kSpread;
  grid_ = kLeastGrid;
  while (grid_ < 2 * steps) grid_ *= 2;
  // In the notation of the paper: M_r = grid, M = grid / 2, R = 2, M_sp = kSpread.
  const double spacing = 2 * std::numbers::pi / grid_;
  const double tau = std::numbers::pi * kSpread / (0.75 * grid_ * grid_);
  const Eigen::Index half = steps / 2;
  const double middle = first + step * static_cast<double>(half);
  turned_.resize(q.size());
  Eigen::ArrayXd falling(kSpread + 1);  // of the Gaussian alone at the grid points
  for (int k = 0; k <= kSpread; ++k) falling[k] = std::exp(-std::pow(k * spacing, 2) / (4 * tau));
  for (Eigen::Index row = 0; row < q.size(); ++row) {
    turned_[row] = std::polar(1.0, -middle * q[row]);
    const double turns = step * q[row] / (2 * std::numbers::pi);
    const double x = (turns - std::floor(turns)) * 2 * std::numbers::pi;
    const int below = static_cast<int>(x / spacing);
    const double beyond = x - below * spacing;
    start_[row] = below - kSpread + 1;
    // exp(-(beyond - k spacing)^2 / 4 tau) from one exponential for all k.
    const double centre = std::exp(-beyond * beyond / (4 * tau));
    const double ratio = std::exp(beyond * spacing / (2 * tau));
    double up = centre, down = centre;
    for (int k = 0; k <= kSpread; ++k, up *= ratio, down /= ratio) {
      if (k > 0 && k < kSpread) spread_(kSpread - 1 - k, row) = down * falling[k];
      spread_(kSpread - 1 + k, row) = up * falling[k];
    }
  }
  correction_.resize(steps);
  for (Eigen::Index k = 0; k < steps; ++k) {
    const auto order = static_cast<double>(k - half);
    correction_[k] = std::sqrt(std::numbers::pi / tau) * std::exp(order * order * tau) / grid_;
  }
}

Eigen::ArrayX2d LineSums::Of(const Eigen::VectorXd& weights) const {
  std::vector<std::complex<double>> on_grid(static_cast<std::size_t>(grid_)), transformed;
  for (Eigen::Index row = 0; row < weights.size(); ++row) {
    const std::complex<double> of_row = weights[row] * turned_[row];
    int point = start_[row];
    if (point < 0) point += grid_;
    for (Eigen::Index k = 0; k < spread_.rows(); ++k) {
      on_grid[point] += spread_(k, row) * of_row;
      if (++point == grid_) point = 0;
    }
  }
  thread_local Eigen::FFT<double> fft;  // keeps the factors of the lengths that it has seen
  fft.fwd(transformed, on_grid);
  Eigen::ArrayX2d sums(steps_, 2);
  for (Eigen::Index k = 0; k < steps_; ++k) {
    const Eigen::Index order = k - steps_ / 2;
    const std::complex<double> sum =
        correction_[k] * transformed[order < 0 ? order + grid_ : order];
    sums(k, 0) = -sum.imag();  // the sum is of exp(-i c q)
    sums(k, 1) = sum.real();
  }
  return sums;
}

namespace {

constexpr double kMinSpan_rad = 0.05;  // minimum range of a joint for separating lines
constexpr double kStepsPerResolution = 3;

bool HigherLine(const PeriodicLine& a, const PeriodicLine& b) {
  return a.gain > b.gain;
}

/// Adds `side` times the angles of `by` to those of `waves`.
Eigen::ArrayX2d Turned(const Eigen::ArrayX2d& waves, const Eigen::ArrayX2d& by, double side) {
  Eigen::ArrayX2d turned(waves.rows(), 2);
  turned.col(0) = waves.col(0) * by.col(1) + side * waves.col(1) * by.col(0);
  turned.col(1) = waves.col(1) * by.col(1) - side * waves.col(0) * by.col(0);
  return turned;
}

}  // namespace

const JointLines& JointLines::Of(const LinearProblem& problem, int joint) {
  return *problem.Kept<std::unique_ptr<JointLines>>(
      joint, [&] { return std::make_unique<JointLines>(problem, joint); });
}

JointLines::JointLines(const LinearProblem& problem, int joint)
    : carried_(problem.CarriedBy({joint})),
      joint_(joint),
      span_rad_(problem.JointSpan(joint)),
      carrier_length_(problem.Carrier(joint).norm()),
      q_(static_cast<Eigen::Index>(carried_.rows().size())),
      square_(carried_.Squares(0)) {
  for (std::size_t k = 0; k < carried_.rows().size(); ++k) {
    const RowIndex row = problem.rows()[carried_.rows()[k]];
    q_[static_cast<Eigen::Index>(k)] = problem.data().conditions[row].q[joint];
  }
  if (!(span_rad_ > kMinSpan_rad)) return;
  step_ = resolution() / kStepsPerResolution;
  const auto steps = static_cast<Eigen::Index>(kMaxCycles / step_);
  // sin^2, cos^2 and sin cos are those of the double angle.
  scan_.emplace(Scan{LineSums(q_, kMinCycles, step_, steps),
                     LineSums(q_, 2 * kMinCycles, 2 * step_, steps).Of(square_)});
  double width = step_ / 2;
  for (Waves& turn : turns_) {
    turn = WavesAt(width);
    width /= 2;
  }
  for (std::size_t k = 0; k < whole_.size(); ++k) {
    whole_[k] = WavesAt(kWholeCycles[k]);
    whole_grams_[k] = carried_.Gram(whole_[k].matrix());
  }
}

double JointLines::ResolutionOf(double span_rad) {
  return 2 * std::numbers::pi / std::max(kMinSpan_rad, span_rad);
}

double JointLines::resolvable() const {
  return kMaxCycles / resolution() * 2;
}

Eigen::VectorXd JointLines::Along(const Eigen::VectorXd& residual) const {
  return carried_.Along(residual);
}

JointLines::Waves JointLines::WavesAt(double cycles) const {
  Waves waves(q_.size(), 2);
  waves.col(0) = (cycles * q_).array().sin();
  waves.col(1) = (cycles * q_).array().cos();
  return waves;
}

double JointLines::GainOf(const Waves& waves, const Eigen::VectorXd& along) const {
  return GainFrom(carried_.Gram(waves.matrix()), waves.matrix().transpose() * along);
}

double JointLines::GainOfWhole(std::size_t number, const Eigen::VectorXd& along) const {
  return GainFrom(whole_grams_[number], whole_[number].matrix().transpose() * along);
}

PeriodicLine JointLines::WithGain(PeriodicLine line, const Eigen::VectorXd& along) const {
  line.gain = GainOf(WavesAt(line.cycles_per_turn), along);
  return line;
}

/// Gains of sine and cosine at equally spaced cycles, nuisances not projected out.
std::vector<double> JointLines::GainsAlong(const Eigen::VectorXd& along) const {
  const Eigen::ArrayX2d moments = scan_->sums.Of(along);
  const double total = square_.sum();
  std::vector<double> gains;
  gains.reserve(moments.rows());
  for (Eigen::Index k = 0; k < moments.rows(); ++k) {
    const double bs = moments(k, 0), bc = moments(k, 1), sc = scan_->twice(k, 0) / 2;
    const double cc = (total + scan_->twice(k, 1)) / 2, ss = total - cc;
    const double det = ss * cc - sc * sc;
    gains.push_back(det > 1e-9 * ss * cc ? (bs * bs * cc - 2 * bs * bc * sc + bc * bc * ss) / det
                                         : 0);
  }
  return gains;
}

std::vector<PeriodicLine> JointLines::Peaks(const Eigen::VectorXd& along) const {
  constexpr std::size_t kMaxPeaks = 4;
  if (!moved()) return {};
  const std::vector<double> gains = GainsAlong(along);
  std::vector<PeriodicLine> peaks;
  for (std::size_t s = 0; s < gains.size(); ++s) {
    const bool rises = s == 0 || gains[s] >= gains[s - 1];
    const bool falls = s + 1 == gains.size() || gains[s] >= gains[s + 1];
    if (rises && falls)
      peaks.push_back({joint_, kMinCycles + step_ * static_cast<double>(s), gains[s], 0});
  }
  std::ranges::sort(peaks, HigherLine);
  if (peaks.size() > kMaxPeaks) peaks.resize(kMaxPeaks);
  return peaks;
}

PeriodicLine JointLines::Refined(PeriodicLine line, const Eigen::VectorXd& along) const {
  Waves waves = WavesAt(line.cycles_per_turn);
  double width = step_ / 2;
  for (const Waves& turn : turns_) {
    for (const double side : {-1.0, 1.0}) {
      const double cycles = line.cycles_per_turn + side * width;
      if (cycles < kMinCycles || cycles > kMaxCycles) continue;
      const Waves turned = Turned(waves, turn, side);
      const double gain = GainOf(turned, along);
      if (gain <= line.gain) continue;
      line = {joint_, cycles, gain, 0};
      waves = turned;
      break;
    }
    width /= 2;
  }
  // A line of amplitude A has the gain A^2 sum |J|^2 / 2.
  line.amplitude_rad = std::sqrt(2 * line.gain) / carrier_length_;
  return line;
}

Eigen::ArrayXd JointLines::SpectralWindow(double first, double step, Eigen::Index steps) const {
  const Eigen::ArrayX2d sums = LineSums(q_, first, step, steps).Of(square_);
  return sums.square().rowwise().sum().sqrt() / std::max(square_.sum(), 1e-300);
}

std::vector<double> JointLines::IndistinctShifts() const {
  // A line at such a shift leaves at most 1 - 0.97^2 = 6 % of the chi2 that the true one explains;
  // whether that rules it out is for its refit to decide.
  constexpr double kIndistinct = 0.97, kStepsOfWindow = 12;
  constexpr int kRefinement = 16;
  if (!moved()) return {};
  const double step = resolution() / kStepsOfWindow, first = 2 * resolution();
  const auto steps = static_cast<Eigen::Index>((2 * kMaxCycles - first) / step);
  if (steps < 3) return {};
  const Eigen::ArrayXd window = SpectralWindow(first, step, steps);
  std::vector<double> shifts;
  for (Eigen::Index k = 1; k + 1 < steps; ++k) {
    if (window[k] < window[k - 1] || window[k] < window[k + 1] || window[k] < 0.9) continue;
    const double fine = step / kRefinement, from = first + step * static_cast<double>(k) - step;
    Eigen::Index at = 0;
    const double highest = SpectralWindow(from, fine, 2 * kRefinement + 1).maxCoeff(&at);
    if (highest >= kIndistinct) shifts.push_back(from + fine * static_cast<double>(at));
  }
  return shifts;
}

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
