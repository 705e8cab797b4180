#include "app/vision/tracking/tag_pose.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "firmware-like/geometry/rotation.h"

namespace plumbline::vision {
namespace {

constexpr int kMaxPoseSteps = 30;
constexpr double kConverged = 1e-10;       // relative change of chi2
constexpr double kCornerFloor_px = 2e-3;   // limit by the quantization of grey levels
constexpr double kAmbiguityChi2Gain = 16;  // of chi2
constexpr double kSameMinimum_sd = 3;
constexpr double kMinCornerSine = 0.02;  // of the clockwise turn at a corner

using Columns = Eigen::Matrix<double, 8, 6>;
using Residual = Eigen::Matrix<double, 8, 1>;

/// chi2 at a pose, its normal equations, and the mixed term with the lens parameters.
struct NormalEquations {
  Mat6 JtJ = Mat6::Zero();
  Vec6 Jtr = Vec6::Zero();
  PoseByLens JtL = PoseByLens::Zero();
  double chi2 = 0;
};

/// One factor per set: covariance + floor = L L^T.
using Whitening = std::vector<Eigen::LLT<CornersCovariance>>;

/// Residuals of a set and their derivatives, whitened by its covariance.
struct SetDerivatives {
  Residual residual;
  Columns by_pose;
  Eigen::Matrix<double, 8, lens::kLensParameters> by_lens;
  Eigen::Matrix<double, 8, 3> by_place;  ///< with respect to the set's position in K
};

std::optional<SetDerivatives> DerivativesOf(const lens::Lens& lens, const CornerSet& set,
                                            const Eigen::LLT<CornersCovariance>& whitening,
                                            const Pose& X) {
  SetDerivatives d;
  for (Eigen::Index k = 0; k < 4; ++k) {
    const Vec3 turned = X.R * set.p_K[k];
    const Vec3 p = turned + X.p;
    if (!(p.z() > 1e-6)) return std::nullopt;
    const lens::Vec2 n = p.head<2>() / p.z();
    Eigen::Matrix<double, 2, 3> by_point;
    by_point << 1 / p.z(), 0, -n.x() / p.z(), 0, 1 / p.z(), -n.y() / p.z();
    by_point = (lens::PixelJacobian(lens, n) * by_point).eval();
    d.by_pose.block<2, 3>(2 * k, 0) = by_point;
    d.by_pose.block<2, 3>(2 * k, 3) = -by_point * CrossMatrix(turned);
    d.by_lens.middleRows<2>(2 * k) = lens::PixelByLens(lens, n);
    d.by_place.block<2, 3>(2 * k, 0) = by_point * X.R;
    d.residual.segment<2>(2 * k) = set.pixels[k] - lens::PixelOfNormalised<double>(lens, n);
  }
  const auto L = whitening.matrixL();
  L.solveInPlace(d.by_pose);
  L.solveInPlace(d.residual);
  L.solveInPlace(d.by_lens);
  L.solveInPlace(d.by_place);
  return d;
}

std::optional<NormalEquations> LinearizeAt(const lens::Lens& lens,
                                           const std::vector<CornerSet>& sets,
                                           const Whitening& whitening, const Pose& X) {
  NormalEquations sum;
  for (std::size_t i = 0; i < sets.size(); ++i) {
    const auto d = DerivativesOf(lens, sets[i], whitening[i], X);
    if (!d) return std::nullopt;
    const Columns& J = d->by_pose;
    sum.JtJ += J.transpose() * J;
    sum.Jtr += J.transpose() * d->residual;
    sum.JtL += J.transpose() * d->by_lens;
    sum.chi2 += d->residual.squaredNorm();
  }
  if (!std::isfinite(sum.chi2)) return std::nullopt;
  return sum;
}

/// See PoseEstimate::unit_position_covariance.
Mat6 UnitPlaceCovariance(const lens::Lens& lens, const std::vector<CornerSet>& sets,
                         const Whitening& whitening, const Pose& X,
                         const Eigen::LDLT<Mat6>& normal) {
  Mat6 sum = Mat6::Zero();
  for (std::size_t i = 0; i < sets.size(); ++i) {
    const auto d = DerivativesOf(lens, sets[i], whitening[i], X);
    if (!d) continue;
    const Eigen::Matrix<double, 6, 3> A = normal.solve(d->by_pose.transpose() * d->by_place);
    sum += A * A.transpose();
  }
  return sum;
}

Pose ApplyStep(const Pose& X, const Vec6& by) {
  return {RotationFromVector(by.tail<3>()) * X.R, X.p + by.head<3>()};
}

}  // namespace

Mat3 PointCovariance(const PoseEstimate& estimate, const Vec3& p_KQ) {
  Eigen::Matrix<double, 3, 6> J;
  J << Mat3::Identity(), -CrossMatrix(estimate.X_CK.R * p_KQ);
  return J * estimate.covariance * J.transpose();
}

double AngleBetween(const Pose& a, const Pose& b) {
  return VectorFromRotation(a.R.transpose() * b.R).norm();
}

std::optional<PoseEstimate> RefinePose(const lens::KnownLens& known,
                                       const std::vector<CornerSet>& sets, const Pose& start) {
  Whitening whitening;
  for (const CornerSet& set : sets) {
    whitening.emplace_back(set.covariance +
                           kCornerFloor_px * kCornerFloor_px * CornersCovariance::Identity());
    if (whitening.back().info() != Eigen::Success) return std::nullopt;
  }
  Pose X = start;
  auto here = LinearizeAt(known.lens, sets, whitening, X);
  if (!here) return std::nullopt;
  double damping = 1e-6;
  for (int step = 0; step < kMaxPoseSteps; ++step) {
    Mat6 damped = here->JtJ;
    damped.diagonal() *= 1 + damping;
    const Vec6 change = damped.ldlt().solve(here->Jtr);
    const Pose next_pose = ApplyStep(X, change);
    auto next = LinearizeAt(known.lens, sets, whitening, next_pose);
    if (!next || !(next->chi2 <= here->chi2)) {
      damping *= 10;
      if (damping > 1e8) break;
      continue;
    }
    const bool done = here->chi2 - next->chi2 <= kConverged * (1 + here->chi2) &&
                      change.dot(here->JtJ * change) < 1e-4;
    X = next_pose;
    here = next;
    damping = std::max(0.1 * damping, 1e-12);
    if (done) break;
  }
  const Eigen::LDLT<Mat6> solved(here->JtJ);
  const PoseByLens by_lens = -solved.solve(here->JtL);
  PoseEstimate estimate{X,          solved.solve(Mat6::Identity()),
                        by_lens,    UnitPlaceCovariance(known.lens, sets, whitening, X, solved),
                        here->chi2, 8 * static_cast<int>(sets.size()) - 6};
  estimate.covariance += by_lens * known.covariance * by_lens.transpose();
  if (!estimate.covariance.allFinite()) return std::nullopt;
  return estimate;
}

bool PosePair::ambiguous() const {
  if (!other) return false;
  const double misfit = std::max(1.0, best.chi2 / std::max(1, best.degrees_of_freedom));
  return other->chi2 - best.chi2 < kAmbiguityChi2Gain * misfit;
}

std::optional<PosePair> BestPoses(const lens::KnownLens& lens, const std::vector<CornerSet>& sets,
                                  const std::vector<Pose>& starts) {
  std::vector<PoseEstimate> minima;
  for (const Pose& start : starts) {
    const auto found = RefinePose(lens, sets, start);
    if (!found) continue;
    const double sd = std::sqrt(found->covariance.bottomRightCorner<3, 3>().trace());
    const bool known = std::ranges::any_of(minima, [&](const PoseEstimate& other) {
      return AngleBetween(found->X_CK, other.X_CK) < kSameMinimum_sd * sd;
    });
    if (!known) minima.push_back(*found);
  }
  if (minima.empty()) return std::nullopt;
  std::ranges::sort(minima,
                    [](const PoseEstimate& a, const PoseEstimate& b) { return a.chi2 < b.chi2; });
  PosePair pair{minima[0], std::nullopt};
  if (minima.size() > 1) pair.other = minima[1];
  return pair;
}

std::optional<PosePair> PosesOfTag(const lens::KnownLens& lens, const Corners& pixels,
                                   const CornersCovariance& covariance, double side_m) {
  for (int k = 0; k < 4; ++k) {
    const lens::Vec2 side = pixels[(k + 1) % 4] - pixels[k];
    const lens::Vec2 next = pixels[(k + 2) % 4] - pixels[(k + 1) % 4];
    const double turn = side.x() * next.y() - side.y() * next.x();
    if (!(turn > kMinCornerSine * side.norm() * next.norm())) return std::nullopt;
  }
  std::array<lens::Vec2, 4> normalised;
  for (int k = 0; k < 4; ++k) {
    const auto n = lens::NormalisedOfPixel(lens.lens, pixels[k]);
    if (!n) return std::nullopt;
    normalised[k] = *n;
  }
  return BestPoses(lens, {{CornersInTag(side_m), pixels, covariance}},
                   PosesOfSquare(normalised, side_m));
}

}  // namespace plumbline::vision
