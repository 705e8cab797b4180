#include "app/vision/lens/capture_change.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "firmware-like/statistics/statistics.h"

namespace plumbline::vision {
namespace {

// Views needed on either side of a jump to count for the undetected covariance: with fewer, noise
// alone produces large estimates.
constexpr std::size_t kMinBeside = 3;
// chi^2 of the focal length that one simulated capture in three exceeds without any change.
constexpr double kExpectedChi2 = 4;

/// Possible changes of the shared parameters: one column per degree of freedom.
using Directions = Eigen::Matrix<double, kSharedCount, Eigen::Dynamic>;

Directions DirectionsOf(CaptureChange::Kind kind, const SharedVector& shared) {
  Directions D = Directions::Zero(kSharedCount, static_cast<int>(kind) + 1);
  switch (kind) {
    case CaptureChange::Kind::kFocalLength:
      D(kFx, 0) = shared[kFx];
      D(kFy, 0) = shared[kFy];
      break;
    case CaptureChange::Kind::kCentre:
      D(kCx, 0) = D(kCy, 1) = 1;
      break;
    case CaptureChange::Kind::kBoard:
      D(kBowX, 0) = D(kBowY, 1) = D(kBowXY, 2) = 1;
      break;
  }
  return D;
}

/// Time course of a change over the views: the weights w_j.
struct ChangeProfile {
  bool steady = false;
  std::size_t first_view_after = 0;
  std::vector<double> w;
};

std::vector<ChangeProfile> AllProfiles(std::span<const BoardView> views) {
  std::vector<ChangeProfile> profiles;
  const double first = views.front().time_s, span = views.back().time_s - first;
  if (span > 0) {
    ChangeProfile steady{true, 0, {}};
    for (const BoardView& view : views) steady.w.push_back((view.time_s - first) / span - 0.5);
    profiles.push_back(std::move(steady));
  }
  for (std::size_t at = 1; at < views.size(); ++at) {
    ChangeProfile jump{false, at, std::vector<double>(views.size(), 0.5)};
    std::fill_n(jump.w.begin(), at, -0.5);
    profiles.push_back(std::move(jump));
  }
  return profiles;
}

/// Estimated change for one profile.
CaptureChange Try(const LensFit& fit, const SharedMatrix& C, const ChangeProfile& profile,
                  const Directions& D, double widening) {
  SharedMatrix A = SharedMatrix::Zero(), square = SharedMatrix::Zero();
  SharedVector pull = SharedVector::Zero();
  for (std::size_t j = 0; j < profile.w.size(); ++j) {
    A += profile.w[j] * fit.view_information[j].information;
    square += profile.w[j] * profile.w[j] * fit.view_information[j].information;
    pull += profile.w[j] * fit.view_information[j].pull;
  }
  const Eigen::VectorXd S = D.transpose() * pull;
  const Eigen::MatrixXd V = D.transpose() * (square - A * C * A) * D;
  const Eigen::VectorXd d = V.ldlt().solve(S);
  CaptureChange change;
  change.steady = profile.steady;
  change.first_view_after = profile.first_view_after;
  change.chi2 = std::max(0.0, S.dot(d) / widening);
  change.delta = D * d;
  const SharedVector bias = C * A * change.delta;
  const SharedVector last = 0.5 * change.delta - bias, first = -0.5 * change.delta - bias;
  change.error = (std::abs(last[kFx]) >= std::abs(first[kFx]) ? last : first).head<kLensCount>();
  return change;
}

/// Standard deviation of a change of the focal length in view j only, for each view (1):
///   V = D^T (H_j - H_j C H_j) D
std::vector<double> SingleViewDeviations(const LensFit& fit, const SharedMatrix& C,
                                         double widening) {
  const Directions D = DirectionsOf(CaptureChange::Kind::kFocalLength, fit.shared);
  std::vector<double> deviations;
  for (const ViewInformation& view : fit.view_information) {
    const SharedMatrix& H = view.information;
    const double V = (D.transpose() * (H - H * C * H) * D)(0, 0);
    deviations.push_back(std::sqrt(widening / std::max(V, 1e-300)));
  }
  return deviations;
}

}  // namespace

SharedMatrix CovarianceWithDroppedFixed(const LensFit& fit) {
  const SharedVector sd = fit.covariance.diagonal().cwiseSqrt();
  SharedMatrix information =
      sd.asDiagonal() * SharedMatrix(fit.covariance.inverse()) * sd.asDiagonal();
  for (int k = 0; k < kSharedCount; ++k) {
    if (!fit.dropped[k]) continue;
    information.row(k).setZero();
    information.col(k).setZero();
    information(k, k) = 1;
  }
  SharedMatrix covariance = information.inverse();
  for (int k = 0; k < kSharedCount; ++k) {
    if (fit.dropped[k]) covariance(k, k) = 0;
  }
  return sd.asDiagonal() * covariance * sd.asDiagonal();
}

CaptureChangeTest TestForCaptureChanges(const LensFit& fit, std::span<const BoardView> views,
                                        double widening) {
  CaptureChangeTest test;
  const SharedMatrix C = CovarianceWithDroppedFixed(fit);
  const std::vector<ChangeProfile> profiles = AllProfiles(views);
  std::vector<double> single = SingleViewDeviations(fit, C, widening);
  test.last_view_focal_sd = single.back();
  test.typical_view_focal_sd = statistics::MedianOf(single);
  double largest_undetected = kExpectedChi2;
  for (std::size_t k = 0; k < test.changes.size(); ++k) {
    CaptureChange& change = test.changes[k];
    change.kind = static_cast<CaptureChange::Kind>(k);
    const Directions D = DirectionsOf(change.kind, fit.shared);
    for (const ChangeProfile& profile : profiles) {
      CaptureChange trial = Try(fit, C, profile, D, widening);
      const double chi2 = trial.chi2;
      const bool early = profile.first_view_after < kMinBeside;
      const bool late = profile.first_view_after + kMinBeside > views.size();
      if (change.kind == CaptureChange::Kind::kFocalLength && chi2 > largest_undetected &&
          (profile.steady || (!early && !late))) {
        largest_undetected = chi2;
        test.undetected_covariance =
            (1 - kExpectedChi2 / chi2) * trial.error * trial.error.transpose();
      }
      if (!(chi2 > change.chi2)) continue;
      trial.kind = change.kind;
      change = trial;
    }
    change.p_value =
        ScanPValue(change.chi2, static_cast<int>(D.cols()), 1 / static_cast<double>(views.size()));
  }
  return test;
}

double ScanPValue(double chi2, int degrees_of_freedom, double first) {
  if (!(chi2 > degrees_of_freedom) || !(first < 0.5)) return 1;
  const double p = 0.5 * degrees_of_freedom, L = 2 * std::log((1 - first) / first);
  const double density = std::pow(0.5 * chi2, p) * std::exp(-0.5 * chi2) / std::tgamma(p);
  return std::min(1.0, density * (L * (1 - degrees_of_freedom / chi2) + 4 / chi2));
}

}  // namespace plumbline::vision
