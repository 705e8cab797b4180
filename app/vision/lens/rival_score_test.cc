// Score tests: how much each rival explanation would improve a fit without extra parameters.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "app/vision/lens/rival_fit.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::vision {
namespace {

constexpr double kMaxDeviations = 3;       // of one view
constexpr double kEliminated = 1e-9;       // share of the information that is round-off
constexpr double kCollinearScores = 1e-6;  // eigenvalue of the scaled information, to the largest

/// What a step is subject to beside the corners, times the squared noise.
struct StepPrior {
  SharedMatrix information;  ///< about the shared parameters
  SharedVector score;        ///< half the derivative of the priors' cost by them
  ExtraVector weights;       ///< information about each extra parameter
};

/// The fit's parameters and those of the rival.
Rival Joined(const Rival& base, const Rival& added) {
  Rival joined = base;
  const auto append = [](const std::vector<int>& from, std::vector<int>& to) {
    for (const int k : from) {
      if (std::ranges::find(to, k) == to.end()) to.push_back(k);
    }
  };
  append(added.global, joined.global);
  append(added.local, joined.local);
  return joined;
}

/// One linear step from a fit, for any choice of the columns of all rivals.
class LinearStep {
 public:
  LinearStep(const std::vector<Rival>& rivals, const Rival& base, const RivalResult& at)
      : at_(at), place_(kExtraCount, -1) {
    all_.fisheye = base.fisheye;
    all_.free_aspect = base.free_aspect;
    AddColumns(base);
    for (const Rival& rival : rivals) AddColumns(rival);
  }

  /// All columns of all rivals, as one rival.
  const Rival& all() const { return all_; }

  /// Adds a view. @param J  derivatives by pose, shared parameters and all().global
  void AddView(const Eigen::MatrixXd& J, const Eigen::VectorXd& residuals) {
    squares_.emplace_back(J.transpose() * J);
    scores_.emplace_back(J.transpose() * residuals);
    const auto used = (residuals.array() != 0).count();
    variances_.push_back(residuals.squaredNorm() / std::max(1.0, static_cast<double>(used)));
  }

  /// A step in the poses, the shared parameters and those of the rival; the decrease is that of the
  /// cost.
  /// @param added  number of the last global parameters that the fit lacks
  ScoreTest Step(const Rival& rival, std::size_t added, const StepPrior& prior) const;

 private:
  using OwnEquations = statistics::GroupEquations<Eigen::Dynamic, Eigen::Dynamic>;
  OwnEquations OwnOf(std::size_t j, const std::vector<int>& own, const std::vector<int>& common,
                     const Rival& rival, const StepPrior& prior) const;
  void AddColumns(const Rival& rival) {
    for (const auto* list : {&rival.global, &rival.local}) {
      for (const int k : *list) {
        if (place_[k] >= 0) continue;
        place_[k] = 6 + kSharedCount + static_cast<int>(all_.global.size());
        all_.global.push_back(k);
      }
    }
  }

  const RivalResult& at_;
  Rival all_;
  std::vector<int> place_;  ///< column of each extra parameter; -1: none
  std::vector<Eigen::MatrixXd> squares_;
  std::vector<Eigen::VectorXd> scores_;
  std::vector<double> variances_;  ///< of the residuals of each view
};

/// Information of one view about the common parameters, and its score.
struct Information {
  Eigen::MatrixXd S;
  Eigen::VectorXd s;
  Eigen::VectorXd whole{};  ///< diagonal of S before the view's own parameters are eliminated
};

/// Lower limit of a ratio of variances, which independent errors exceed by two standard deviations:
///   r / (1 + 2 sqrt(2 / nu))
double ProvedRatio(double ratio, double degrees_of_freedom) {
  return ratio / (1 + 2 * std::sqrt(2 / degrees_of_freedom));
}

/// Variance of the scores of the last `added` parameters about the step, the others eliminated:
///   trace(I^-1 sum u_j u_j^T) / added n / (n - 1),  u_j = s_j - I_j step
/// with s_j and I_j score and information of view j about them, I the sum of the I_j, and
///   n = 1 / sum (trace(I^-1 I_j) / added)^2
/// the number of views that count; its lower limit with added (n - 1) degrees of freedom. [K.
/// Liang, S. Zeger, Biometrika 73 (1986) 13]
/// @param C     covariance of the common parameters over the squared noise
/// @param step  of the common parameters
/// @param most_per_view  a view with wrong corners counts as at most this variance
double ScoreDispersion(const std::vector<Information>& views, const Eigen::MatrixXd& C,
                       const Eigen::VectorXd& step, Eigen::Index added, double most_per_view) {
  if (added == 0 || views.size() < 2) return 0;
  // Columns of the added parameters, less what the other parameters explain of them.
  const Eigen::MatrixXd last = C.rightCols(added);
  const Eigen::MatrixXd own =
      last * last.bottomRows(added).ldlt().solve(Eigen::MatrixXd::Identity(added, added));
  std::vector<Eigen::MatrixXd> shares;
  std::vector<Eigen::VectorXd> scores;
  Eigen::MatrixXd total = Eigen::MatrixXd::Zero(added, added);
  for (const Information& view : views) {
    shares.emplace_back(own.transpose() * view.S * own);
    scores.emplace_back(own.transpose() * view.s - shares.back() * step.tail(added));
    total += shares.back();
  }
  const auto factor = total.ldlt();
  double scatter = 0, squares = 0;
  for (std::size_t j = 0; j < views.size(); ++j) {
    const double share = factor.solve(shares[j]).trace();
    scatter += std::min(scores[j].dot(factor.solve(scores[j])), most_per_view * share);
    squares += share * share;
  }
  const auto count = static_cast<double>(added);
  const double n = count * count / squares;
  if (!(n > 1)) return 0;
  return ProvedRatio(scatter / count * n / (n - 1), count * (n - 1));
}

/// Mean square of the residuals in the directions that the shared parameters span in each view, the
/// view's own parameters eliminated.
/// @param step  of the common parameters, the shared ones first
double SmoothDispersion(const std::vector<Information>& views, const Eigen::VectorXd& step) {
  double energy = 0;
  int directions = -kSharedCount;  // fitted
  for (const Information& view : views) {
    const SharedMatrix S = view.S.topLeftCorner<kSharedCount, kSharedCount>();
    const SharedVector score = view.s.head<kSharedCount>() - S * step.head<kSharedCount>();
    // The view's own parameters may leave nothing of a shared one, such as of the focal length.
    SharedVector scale = SharedVector::Zero();
    for (int k = 0; k < kSharedCount; ++k) {
      if (S(k, k) > kEliminated * view.whole[k]) scale[k] = 1 / std::sqrt(S(k, k));
    }
    const Eigen::SelfAdjointEigenSolver<SharedMatrix> solver(scale.asDiagonal() * S *
                                                             scale.asDiagonal());
    const SharedVector along = solver.eigenvectors().transpose() * scale.cwiseProduct(score);
    for (int k = 0; k < kSharedCount; ++k) {
      if (solver.eigenvalues()[k] < kCollinearScores * solver.eigenvalues()[kSharedCount - 1])
        continue;
      energy += along[k] * along[k] / solver.eigenvalues()[k];
      ++directions;
    }
  }
  return directions > 0 ? ProvedRatio(energy / directions, directions) : 0;
}

/// A value with its variance.
struct Estimate {
  double value = 0, variance = 0;
};

/// Spread of a local parameter about its mean, which the shared parameters can take up.
void SetLocal(const std::vector<Estimate>& views, ScoreTest& test) {
  double weights = 0, weighted = 0;
  std::vector<double> variances;
  for (const Estimate& view : views) {
    weights += 1 / view.variance;
    weighted += view.value / view.variance;
    variances.push_back(view.variance);
  }
  const double limit = kMaxDeviations * kMaxDeviations * test.view_dispersion;
  for (const Estimate& view : views) {
    const double away = view.value - weighted / weights;
    test.local_square += std::min(away * away / view.variance, limit);
  }
  test.local_square /= std::max(1.0, static_cast<double>(views.size()) - 1);
  test.local_deviation = std::sqrt(statistics::MedianOf(variances));
}

/// @param C        covariance of the common parameters over the squared noise; the added ones last
/// @param weights  information of the priors about the added ones, likewise
double OccamOf(const Eigen::MatrixXd& C, const Eigen::VectorXd& weights) {
  if (weights.size() == 0) return 0;
  const Eigen::VectorXd root = weights.cwiseSqrt();
  const Eigen::MatrixXd scaled =
      root.asDiagonal() * C.bottomRightCorner(weights.size(), weights.size()) * root.asDiagonal();
  return -0.5 * std::log(std::max(1e-300, scaled.determinant()));
}

LinearStep::OwnEquations LinearStep::OwnOf(std::size_t j, const std::vector<int>& own,
                                           const std::vector<int>& common, const Rival& rival,
                                           const StepPrior& prior) const {
  OwnEquations system{squares_[j](own, own), squares_[j](own, common), scores_[j](own)};
  for (std::size_t k = 6; k < own.size(); ++k) {
    const int extra = rival.local[k - 6];
    system.A(k, k) += prior.weights[extra];
    system.a[k] += prior.weights[extra] * at_.local[j][extra];
  }
  return system;
}

ScoreTest LinearStep::Step(const Rival& rival, std::size_t added, const StepPrior& prior) const {
  std::vector<int> own{0, 1, 2, 3, 4, 5}, common;
  for (int k = 0; k < kSharedCount; ++k) common.push_back(6 + k);
  for (const int k : rival.local) own.push_back(place_[k]);
  for (const int k : rival.global) common.push_back(place_[k]);
  Eigen::MatrixXd S = Eigen::MatrixXd::Zero(common.size(), common.size());
  Eigen::VectorXd s = Eigen::VectorXd::Zero(common.size());
  S.topLeftCorner<kSharedCount, kSharedCount>() = prior.information;
  s.head<kSharedCount>() = prior.score;
  for (std::size_t k = kSharedCount; k < common.size(); ++k) {
    const int extra = rival.global[k - kSharedCount];
    S(k, k) = prior.weights[extra];
    s[k] = prior.weights[extra] * at_.extra[extra];
  }
  double sum = 0;
  std::vector<Information> views;
  for (std::size_t j = 0; j < squares_.size(); ++j) {
    Information& view = views.emplace_back(Information{
        squares_[j](common, common), scores_[j](common), squares_[j](common, common).diagonal()});
    const OwnEquations equations = OwnOf(j, own, common, rival, prior);
    sum += equations.a.dot(equations.Eliminate(view.S, view.s).solve(equations.a));
    S += view.S;
    s += view.s;
  }
  const Eigen::MatrixXd C = S.ldlt().solve(Eigen::MatrixXd::Identity(S.rows(), S.cols()));
  const Eigen::VectorXd d = C * s;
  ScoreTest test;
  test.rival = rival;
  std::vector<double> variances = variances_;
  test.view_dispersion = statistics::MedianOf(variances);
  std::vector<Estimate> estimates;
  for (std::size_t j = 0; !rival.local.empty() && j < squares_.size(); ++j) {
    const auto [A, B, a] = OwnOf(j, own, common, rival, prior);
    const Eigen::VectorXd last = A.ldlt().solve(Eigen::VectorXd::Unit(A.rows(), A.rows() - 1));
    estimates.push_back({last.dot(a - B * d), last[last.size() - 1]});
  }
  if (!estimates.empty()) SetLocal(estimates, test);
  test.decrease = sum + s.dot(d);
  test.result.shared = at_.shared - d.head<kSharedCount>();
  test.result.extra = at_.extra;
  for (std::size_t k = 0; k < rival.global.size(); ++k)
    test.result.extra[rival.global[k]] -= d[kSharedCount + k];
  Eigen::VectorXd weights(added);
  for (std::size_t k = 0; k < added; ++k)
    weights[k] = prior.weights[rival.global[rival.global.size() - added + k]];
  test.occam = OccamOf(C, weights);
  if (!rival.local.empty()) test.smooth_dispersion = SmoothDispersion(views, d);
  test.score_dispersion = ScoreDispersion(views, C, d, weights.size(),
                                          kMaxDeviations * kMaxDeviations * test.view_dispersion);
  test.covariance = LensCovarianceIn(rival, C);
  return test;
}

}  // namespace

std::vector<ScoreTest> RivalProblem::ScoreTests(const std::vector<Rival>& rivals, const Rival& base,
                                                const RivalResult& at) const {
  LinearStep step(rivals, base, at);
  std::vector<Blocks> blocks;
  if (!Linearize(step.all(), at, blocks)) return {};
  for (const Blocks& block : blocks) {
    Eigen::MatrixXd J(block.own.rows(), block.own.cols() + block.common.cols());
    J << block.own, block.common;
    step.AddView(J, block.residuals);
  }
  const double noise2 = noise_px_ * noise_px_;
  SharedVector mean;
  StepPrior prior;
  prior.information = noise2 * PriorInformation(base, at.shared, mean);
  prior.score = prior.information * (at.shared - mean);
  prior.weights = noise2 * DeviationsOf(base).array().square().inverse();
  const auto step_with = [&](const Rival& added) {
    const Rival rival = Joined(base, added);
    ScoreTest test = step.Step(rival, rival.global.size() - base.global.size(), prior);
    test.decrease /= noise2;
    test.covariance *= noise2;
    test.local_deviation *= noise_px_;
    test.local_square /= noise2;
    test.view_dispersion /= noise2;
    test.score_dispersion /= noise2;
    test.smooth_dispersion /= noise2;
    return test;
  };
  const double base_decrease = step_with({}).decrease;
  std::vector<ScoreTest> tests;
  for (const Rival& rival : rivals) {
    tests.push_back(step_with(rival));
    tests.back().decrease = std::max(0.0, tests.back().decrease - base_decrease);
  }
  return tests;
}

}  // namespace plumbline::vision
