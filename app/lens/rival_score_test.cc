// Score tests: how much each rival explanation would improve a fit without extra parameters.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "app/lens/rival_fit.h"

namespace plumbline::lens {
namespace {

/// One linear step of the fit, for any choice of the columns of all rivals.
class LinearStep {
 public:
  /// @param prior          information about the shared parameters, times the squared noise
  /// @param prior_weights  likewise of each extra parameter
  LinearStep(const std::vector<Rival>& rivals, const SharedMatrix& prior,
             const ExtraVector& prior_weights)
      : place_(kExtraCount, -1), prior_(prior), prior_weights_(prior_weights) {
    for (const Rival& rival : rivals) {
      for (const auto* list : {&rival.global, &rival.local}) {
        for (const int k : *list) {
          if (place_[k] >= 0) continue;
          place_[k] = 6 + kSharedCount + static_cast<int>(all_.global.size());
          all_.global.push_back(k);
        }
      }
    }
  }

  /// All columns of all rivals, as one rival.
  const Rival& all() const { return all_; }

  /// Adds a view. @param J  derivatives by pose, shared parameters and all().global
  void AddView(const Eigen::MatrixXd& J, const Eigen::VectorXd& residuals) {
    squares_.emplace_back(J.transpose() * J);
    scores_.emplace_back(J.transpose() * residuals);
  }

  /// A step in the poses, the shared parameters and those of the rival from `plain`; the decrease
  /// is that of the cost.
  ScoreTest Step(const Rival& rival, const RivalResult& plain) const;

 private:
  Rival all_;
  std::vector<int> place_;  ///< column of each extra parameter; -1: none
  SharedMatrix prior_;
  ExtraVector prior_weights_;
  std::vector<Eigen::MatrixXd> squares_;
  std::vector<Eigen::VectorXd> scores_;
};

/// @param S  information about the common parameters, times the squared noise; the extra ones last
/// @param weights  of their priors, likewise
double OccamOf(const Eigen::MatrixXd& S, const Eigen::VectorXd& weights) {
  const Eigen::Index extras = weights.size();
  if (extras == 0) return 0;
  const Eigen::MatrixXd C = S.ldlt()
                                .solve(Eigen::MatrixXd::Identity(S.rows(), S.cols()))
                                .bottomRightCorner(extras, extras);
  const Eigen::VectorXd root = weights.cwiseSqrt();
  const Eigen::MatrixXd scaled = root.asDiagonal() * C * root.asDiagonal();
  return -0.5 * std::log(std::max(1e-300, scaled.determinant()));
}

ScoreTest LinearStep::Step(const Rival& rival, const RivalResult& plain) const {
  std::vector<int> own{0, 1, 2, 3, 4, 5}, common;
  for (int k = 0; k < kSharedCount; ++k) common.push_back(6 + k);
  for (const int k : rival.local) own.push_back(place_[k]);
  for (const int k : rival.global) common.push_back(place_[k]);
  Eigen::MatrixXd S = Eigen::MatrixXd::Zero(common.size(), common.size());
  S.topLeftCorner<kSharedCount, kSharedCount>() = prior_;
  for (std::size_t k = kSharedCount; k < common.size(); ++k)
    S(k, k) = prior_weights_[rival.global[k - kSharedCount]];
  Eigen::VectorXd s = Eigen::VectorXd::Zero(common.size());
  double sum = 0;
  for (std::size_t j = 0; j < squares_.size(); ++j) {
    Eigen::MatrixXd A = squares_[j](own, own);
    for (std::size_t k = 6; k < own.size(); ++k) A(k, k) += prior_weights_[rival.local[k - 6]];
    const Eigen::MatrixXd B = squares_[j](own, common);
    const Eigen::VectorXd a = scores_[j](own);
    const auto factor = A.ldlt();
    S += squares_[j](common, common) - B.transpose() * factor.solve(B);
    s += scores_[j](common) - B.transpose() * factor.solve(a);
    sum += a.dot(factor.solve(a));
  }
  const Eigen::VectorXd d = S.ldlt().solve(s);
  ScoreTest test;
  test.decrease = sum + s.dot(d);
  test.result.shared = plain.shared - d.head<kSharedCount>();
  Eigen::VectorXd weights(rival.global.size());
  for (Eigen::Index k = 0; k < weights.size(); ++k) {
    test.result.extra[rival.global[k]] = -d[kSharedCount + k];
    weights[k] = prior_weights_[rival.global[k]];
  }
  test.occam = OccamOf(S, weights);
  return test;
}

}  // namespace

std::vector<ScoreTest> RivalProblem::ScoreTests(const std::vector<Rival>& rivals,
                                                const RivalResult& plain) const {
  SharedVector mean;
  LinearStep step(rivals, noise_px_ * noise_px_ * PriorInformation({}, plain.shared, mean),
                  (noise_px_ / deviations_.array()).square().matrix());
  std::vector<Blocks> blocks;
  if (!Linearize(step.all(), plain, blocks)) return {};
  std::vector<ScoreTest> tests(rivals.size());
  for (const Blocks& block : blocks) {
    Eigen::MatrixXd J(block.own.rows(), block.own.cols() + block.common.cols());
    J << block.own, block.common;
    step.AddView(J, block.residuals);
  }
  const double base = step.Step({}, plain).decrease;
  for (std::size_t k = 0; k < rivals.size(); ++k) {
    tests[k] = step.Step(rivals[k], plain);
    tests[k].decrease = std::max(0.0, tests[k].decrease - base) / (noise_px_ * noise_px_);
  }
  return tests;
}

}  // namespace plumbline::lens
