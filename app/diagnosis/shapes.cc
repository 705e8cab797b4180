// The best shapes of searched effects: cycles of a gear, the time constant of a drift, the moment
// of a step.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "app/diagnosis/search.h"

namespace plumbline {
namespace {

using I = Influence<double>;
constexpr int kShapesKept = 2;

/// The drop of chi2 when columns are fitted to the residual.
double Gain(const LinearProblem& problem, Eigen::MatrixXd columns,
            const Eigen::VectorXd& residual) {
  problem.Project(columns);
  Eigen::MatrixXd gram = columns.transpose() * columns;
  const Eigen::VectorXd moment = columns.transpose() * residual;
  gram.diagonal().array() += 1e-9 * gram.diagonal().maxCoeff() + 1e-300;
  return moment.dot(gram.ldlt().solve(moment));
}

/// Value of a signal at each row of the problem.
template <typename F>
Eigen::VectorXd AtRows(const LinearProblem& problem, const F& f) {
  Eigen::VectorXd values(static_cast<int>(problem.rows().size()));
  for (int j = 0; j < values.size(); ++j) {
    const auto row = static_cast<std::size_t>(problem.rows()[static_cast<std::size_t>(j)]);
    values[j] = f(problem.data().conditions[row]);
  }
  return values;
}

std::vector<int> Three(int first) {
  return {first, first + 1, first + 2};
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

struct Peak {
  double gain = 0;
  double cycles = 0;
  double amplitude_rad = 0;
};

/// Gains of sin and cos at rising cycles, from sums over rows; local maxima, largest first.
std::vector<Peak> PeriodicPeaks(const LinearProblem& problem, int joint,
                                const Eigen::VectorXd& residual, double& trials) {
  const int axes = problem.linear().axes;
  const auto count = static_cast<int>(problem.rows().size());
  const Eigen::VectorXd q = AtRows(problem, [joint](const Conditions& m) { return m.q[joint]; });
  const Eigen::VectorXd& turn = problem.Carrier(joint);
  Eigen::VectorXd along(count), square(count);
  for (int j = 0; j < count; ++j) {
    along[j] = turn.segment(j * axes, axes).dot(residual.segment(j * axes, axes));
    square[j] = turn.segment(j * axes, axes).squaredNorm();
  }
  const double span = q.maxCoeff() - q.minCoeff();
  if (!(span > 0.05)) return {};
  constexpr double kFewestCycles = 0.5, kMostCycles = 400;
  const double lobe = 2 * std::numbers::pi / span;  // width of a line
  const double step = lobe / 6;
  const auto steps = static_cast<int>(kMostCycles / step);
  trials = kMostCycles / lobe * 2;
  using Complex = std::complex<double>;
  std::vector<Complex> phase(static_cast<std::size_t>(count)),
      turn_by(static_cast<std::size_t>(count));
  for (int j = 0; j < count; ++j) {
    phase[static_cast<std::size_t>(j)] = std::polar(1.0, kFewestCycles * q[j]);
    turn_by[static_cast<std::size_t>(j)] = std::polar(1.0, step * q[j]);
  }
  std::vector<double> gains;
  for (int s = 0; s < steps; ++s) {
    double bs = 0, bc = 0, ss = 0, cc = 0, sc = 0;
    for (int j = 0; j < count; ++j) {
      Complex& at = phase[static_cast<std::size_t>(j)];
      const double c = at.real(), n = at.imag();
      bs += along[j] * n;
      bc += along[j] * c;
      ss += square[j] * n * n;
      cc += square[j] * c * c;
      sc += square[j] * n * c;
      at *= turn_by[static_cast<std::size_t>(j)];
    }
    const double det = ss * cc - sc * sc;
    gains.push_back(det > 1e-9 * ss * cc ? (bs * bs * cc - 2 * bs * bc * sc + bc * bc * ss) / det
                                         : 0);
  }
  std::vector<Peak> peaks;
  for (std::size_t s = 0; s < gains.size(); ++s) {
    const bool rises = s == 0 || gains[s] >= gains[s - 1];
    const bool falls = s + 1 == gains.size() || gains[s] >= gains[s + 1];
    if (rises && falls)
      peaks.push_back({gains[s], kFewestCycles + step * static_cast<double>(s), 0});
  }
  std::sort(peaks.begin(), peaks.end(),
            [](const Peak& a, const Peak& b) { return a.gain > b.gain; });
  if (peaks.size() > 4) peaks.resize(4);
  // Exactly, with the frames taken out, between the steps.
  const auto exact = [&](double cycles) { return PeriodicGain(problem, joint, cycles, residual); };
  for (Peak& peak : peaks) {
    double width = step;
    peak.gain = exact(peak.cycles);
    for (int pass = 0; pass < 5; ++pass, width /= 2) {
      for (const double side : {-1.0, 1.0}) {
        const double cycles = peak.cycles + side * width / 2;
        const double gain = exact(cycles);
        if (gain > peak.gain) peak = {gain, cycles, 0};
      }
    }
  }
  // A line of amplitude A has the gain A^2 sum |J|^2 / 2.
  for (Peak& peak : peaks) peak.amplitude_rad = std::sqrt(2 * peak.gain / square.sum());
  std::sort(peaks.begin(), peaks.end(),
            [](const Peak& a, const Peak& b) { return a.gain > b.gain; });
  return peaks;
}

void KeepBest(std::vector<std::pair<double, Block>>& found, std::size_t most) {
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  if (found.size() > most) found.resize(most);
}

std::vector<Block> DriftShapes(const LinearProblem& problem, const Eigen::VectorXd& residual) {
  double span = 0;
  for (const Conditions& moment : problem.data().conditions) {
    span = std::max(span, moment.t_s.value_or(0));
  }
  if (!(span > 0)) return {};
  const Eigen::VectorXd t = AtRows(problem, [](const Conditions& m) { return m.t_s.value_or(0); });
  constexpr int kSteps = 24;
  constexpr double kTrials = 4;  // curves of neighbouring time constants are nearly the same
  std::vector<std::pair<double, Block>> found;
  for (int k = 0; k < kSteps; ++k) {
    const double tau = span / 40 * std::pow(200.0, static_cast<double>(k) / (kSteps - 1));
    const Eigen::MatrixXd warmth = 1 - (-t / tau).array().exp();
    found.emplace_back(Gain(problem, problem.Carried(Three(I::kBase), warmth), residual),
                       DriftBlock(tau, kTrials));
  }
  KeepBest(found, kShapesKept);
  std::vector<Block> blocks;
  blocks.reserve(found.size());
  for (auto& [gain, block] : found) blocks.push_back(std::move(block));
  return blocks;
}

/// t_s of each row where recorded, else its place.
Eigen::VectorXd Clock(const LinearProblem& problem) {
  const bool timed = problem.data().table.recorded.time;
  return AtRows(problem, [timed](const Conditions& moment) {
    return timed ? moment.t_s.value_or(0) : moment.row.value_or(0);
  });
}

/// Moments halfway between rows that follow each other in time.
std::vector<double> Moments(const LinearProblem& problem) {
  std::vector<double> times;
  const Eigen::VectorXd at_rows = Clock(problem);
  times.assign(at_rows.begin(), at_rows.end());
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  std::vector<double> moments;
  const std::size_t margin = std::max<std::size_t>(4, times.size() / 20);
  for (std::size_t k = margin; k + margin < times.size(); ++k)
    moments.push_back((times[k - 1] + times[k]) / 2);
  return moments;
}

std::vector<Block> StepShapes(const LinearProblem& problem, const Eigen::VectorXd& residual) {
  const std::vector<double> moments = Moments(problem);
  if (moments.empty()) return {};
  constexpr std::size_t kCoarse = 150;
  const std::size_t stride = moments.size() / kCoarse + 1;
  const double trials = static_cast<double>(moments.size());
  std::vector<Block> blocks;
  const Eigen::VectorXd clock = Clock(problem);
  for (const char* frame : {"base", "tool"}) {
    const int entry = frame[0] == 't' ? I::kTip : I::kBase;
    std::vector<std::pair<double, Block>> found;
    std::size_t best = 0;
    double best_gain = -1;
    const auto judge = [&](std::size_t k) {
      const Eigen::MatrixXd happened = (clock.array() >= moments[k]).cast<double>();
      const double gain = Gain(problem, problem.Carried(Three(entry), happened), residual);
      if (gain > best_gain) {
        best_gain = gain;
        best = k;
      }
      found.emplace_back(gain, StepBlock(problem.data(), moments[k], frame, trials));
    };
    for (std::size_t k = 0; k < moments.size(); k += stride) judge(k);
    if (stride > 1) {
      const std::size_t around = best;
      const std::size_t from = around > stride ? around - stride : 0;
      for (std::size_t k = from; k < std::min(moments.size(), around + stride); ++k) judge(k);
    }
    KeepBest(found, 1);
    blocks.push_back(std::move(found.front().second));
  }
  return blocks;
}

/// Moments at which the camera was zoomed: where zoom_counts is recorded those at which it changed,
/// else all.
std::vector<double> ZoomMoments(const LinearProblem& problem) {
  constexpr std::string_view kColumn = "zoom_counts";
  if (!problem.data().conditions.front().Signal(kColumn)) return Moments(problem);
  const Eigen::VectorXd clock = Clock(problem);
  const Eigen::VectorXd zoom =
      AtRows(problem, [&](const Conditions& m) { return m.Signal(kColumn).value_or(0); });
  std::vector<std::pair<double, double>> rows;
  rows.reserve(static_cast<std::size_t>(clock.size()));
  for (int j = 0; j < clock.size(); ++j) rows.emplace_back(clock[j], zoom[j]);
  std::sort(rows.begin(), rows.end());
  std::vector<double> moments;
  for (std::size_t k = 1; k < rows.size(); ++k) {
    if (rows[k].second != rows[k - 1].second)
      moments.push_back((rows[k - 1].first + rows[k].first) / 2);
  }
  return moments;
}

std::vector<Block> ZoomShapes(const LinearProblem& problem, const Eigen::VectorXd& residual) {
  const std::vector<double> moments = ZoomMoments(problem);
  const Eigen::VectorXd clock = Clock(problem);
  std::vector<std::pair<double, Block>> found;
  found.reserve(moments.size());
  for (const double moment : moments) {
    const Eigen::MatrixXd begun = (clock.array() >= moment).cast<double>();
    found.emplace_back(Gain(problem, problem.Carried({I::kCameraDepth}, begun), residual),
                       ZoomBlock(problem.data(), moment, static_cast<double>(moments.size())));
  }
  KeepBest(found, 1);
  std::vector<Block> blocks;
  blocks.reserve(found.size());
  for (auto& [gain, block] : found) blocks.push_back(std::move(block));
  return blocks;
}

}  // namespace

std::vector<PeriodicLine> PeriodicLines(const LinearProblem& problem,
                                        const Eigen::VectorXd& residual) {
  std::vector<PeriodicLine> lines;
  constexpr double kLargestLine_rad = 2e-3, kLeastSeen = 5;  // of a gear; sigma over all rows
  for (int joint = 0; joint < problem.data().cell.robot.size(); ++joint) {
    if (kLargestLine_rad * problem.Carrier(joint).norm() < kLeastSeen) continue;  // no lever
    double trials = 1;
    for (const Peak& peak : PeriodicPeaks(problem, joint, residual, trials)) {
      lines.push_back({joint, peak.cycles, peak.gain, peak.amplitude_rad});
    }
  }
  return lines;
}

std::vector<int> AddShapes(Pool& pool, const std::vector<const Effect*>& searched,
                           const Eigen::VectorXd& residual) {
  const LinearProblem& problem = pool.problem();
  std::vector<Block> blocks;
  for (const Effect* effect : searched) {
    const std::string_view id = effect->traits().id;
    if (id == "gear_periodic") {
      std::vector<std::pair<double, Block>> found, eccentric;
      double trials = 1;
      const double joints = problem.data().cell.robot.size();
      for (int joint = 0; joint < problem.data().cell.robot.size(); ++joint) {
        double of_joint = 1;
        for (const Peak& peak : PeriodicPeaks(problem, joint, residual, of_joint)) {
          found.emplace_back(peak.gain, PeriodicBlock(joint, peak.cycles, 1));
        }
        if (of_joint == 1) continue;  // it never moved far
        for (const double whole : {1.0, 2.0}) {
          eccentric.emplace_back(PeriodicGain(problem, joint, whole, residual),
                                 PeriodicBlock(joint, whole, joints));
        }
        trials += of_joint;
      }
      KeepBest(eccentric, 3);
      for (auto& [gain, block] : eccentric) blocks.push_back(std::move(block));
      KeepBest(found, 3);
      for (auto& [gain, block] : found) {
        block.trials = trials;
        blocks.push_back(std::move(block));
      }
    } else if (id == "thermal_drift") {
      for (Block& block : DriftShapes(problem, residual)) blocks.push_back(std::move(block));
    } else if (id == "step_event") {
      for (Block& block : StepShapes(problem, residual)) blocks.push_back(std::move(block));
    } else if (id == "camera_zoom") {
      for (Block& block : ZoomShapes(problem, residual)) blocks.push_back(std::move(block));
    }
  }
  std::vector<int> indices;
  for (const Block& block : blocks) {
    const int index = pool.Add(block);
    if (pool.Observable(index)) indices.push_back(index);
  }
  return indices;
}

}  // namespace plumbline
