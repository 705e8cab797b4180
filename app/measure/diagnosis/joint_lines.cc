#include "app/measure/diagnosis/joint_lines.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace plumbline::measure {
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

}  // namespace plumbline::measure
