// Precision of the lens of a rival explanation.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "app/vision/lens/rival_fit.h"

namespace plumbline::vision {
namespace {

constexpr double kCollinear = 1e-4;  // for collinear columns of a view

/// Index among the lens parameters of a common parameter: first those of Shared, then extras.
/// @return  -1 if it is none, or does not count in that lens
int LensParameterOf(const Rival& rival, int common) {
  if (common < kLensCount) {
    const bool tangential = common == kP1 || common == kP2;
    return rival.fisheye && tangential ? -1 : common;
  }
  if (common < kSharedCount) return -1;
  switch (rival.global[common - kSharedCount]) {
    case kK4:
      return 9;
    case kK5:
      return 10;
    case kK6:
      return 11;
    case kPrism1:
      return 12;
    case kPrism2:
      return 13;
    case kPrism3:
      return 14;
    case kPrism4:
      return 15;
    default:
      return -1;
  }
}

/// Energy of a view's residuals in the space of its derivatives, and the dimension of that space.
std::pair<double, Eigen::Index> Explained(const Eigen::MatrixXd& own, const Eigen::MatrixXd& common,
                                          const Eigen::VectorXd& residuals) {
  Eigen::MatrixXd both(residuals.size(), own.cols() + common.cols());
  both << own, common;
  both *= both.colwise().norm().cwiseMax(1e-300).cwiseInverse().asDiagonal();
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(both);
  qr.setThreshold(kCollinear);
  const Eigen::VectorXd along = qr.householderQ().transpose() * residuals;
  return {along.head(qr.rank()).squaredNorm(), qr.rank()};
}

/// Mean over all points of the squared mean residual over the views, less what noise of that
/// variance leaves in a mean; per coordinate.
double CommonVariance(const std::vector<Eigen::VectorXd>& residuals,
                      const std::vector<std::vector<bool>>& used, double variance) {
  double sum = 0;
  int count = 0;
  for (std::size_t k = 0; k < used[0].size(); ++k) {
    lens::Vec2 mean = lens::Vec2::Zero();
    int views = 0;
    for (std::size_t j = 0; j < residuals.size(); ++j) {
      if (!used[j][k]) continue;
      mean += residuals[j].segment<2>(2 * static_cast<Eigen::Index>(k));
      ++views;
    }
    if (views < 2) continue;
    sum += 0.5 * (mean / views).squaredNorm() - variance / views;
    ++count;
  }
  return count > 0 ? std::max(0.0, sum / count) : 0;
}

}  // namespace

lens::LensCovariance LensCovarianceIn(const Rival& rival, const Eigen::MatrixXd& covariance) {
  lens::LensCovariance of_lens = lens::LensCovariance::Zero();
  for (int i = 0; i < covariance.rows(); ++i) {
    for (int k = 0; k < covariance.cols(); ++k) {
      const int a = LensParameterOf(rival, i), b = LensParameterOf(rival, k);
      if (a >= 0 && b >= 0) of_lens(a, b) = covariance(i, k);
    }
  }
  return of_lens;
}

RivalPrecision RivalProblem::PrecisionOf(const Rival& rival, const RivalResult& at) const {
  RivalPrecision precision;
  std::vector<Blocks> blocks;
  if (!Linearize(rival, at, blocks)) {
    precision.dispersion = INFINITY;
    return precision;
  }
  const double noise2 = noise_px_ * noise_px_;
  precision.noise_px = noise_px_;
  const NormalEquations normal = NormalEquationsOf(rival, at, blocks);
  Eigen::MatrixXd S = normal.H;
  Eigen::VectorXd s = normal.g;
  double energy = 0;
  Eigen::Index freedom = -kSharedCount;
  std::vector<Eigen::VectorXd> residuals;
  std::vector<std::vector<bool>> used;
  for (std::size_t j = 0; j < blocks.size(); ++j) {
    normal.own[j].Eliminate(S, s);
    const auto [explained, rank] =
        Explained(blocks[j].own, blocks[j].common.leftCols<kSharedCount>(), blocks[j].residuals);
    energy += explained;
    freedom += rank - blocks[j].own.cols();
    const auto corners = std::ranges::count(views_[j].used, true);
    precision.view_rms_px.push_back(blocks[j].residuals.norm() /
                                    std::sqrt(std::max(1.0, 2.0 * static_cast<double>(corners))));
    residuals.push_back(blocks[j].residuals);
    used.push_back(views_[j].used);
  }
  precision.covariance = LensCovarianceIn(
      rival, noise2 * S.ldlt().solve(Eigen::MatrixXd::Identity(S.rows(), S.cols())));
  const double remaining =
      std::max(1.0, static_cast<double>(at.observations) - static_cast<double>(S.rows()) -
                        (6.0 + static_cast<double>(rival.local.size())) *
                            static_cast<double>(blocks.size()));
  const double variance = at.square_sum_px2 / remaining;
  precision.sigma_px = std::sqrt(variance);
  const double common = CommonVariance(residuals, used, variance);
  precision.dispersion = std::max(
      {1.0, variance / noise2, freedom > 0 ? energy / noise2 / static_cast<double>(freedom) : 1.0,
       (variance + static_cast<double>(blocks.size()) * common) / noise2});
  return precision;
}

}  // namespace plumbline::vision
