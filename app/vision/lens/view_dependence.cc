#include "app/vision/lens/view_dependence.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "app/vision/lens/capture_change.h"
#include "app/vision/lens/projection_uncertainty.h"

namespace plumbline::vision {
namespace {

constexpr std::array kTraits{ViewTrait::kTime,   ViewTrait::kLateHalf, ViewTrait::kDistance,
                             ViewTrait::kTiltX,  ViewTrait::kTiltY,    ViewTrait::kTurn,
                             ViewTrait::kPlaceX, ViewTrait::kPlaceY};
// Chance exceeds it in one capture of a hundred: one degree of freedom, all traits and directions.
constexpr double kMinChi2 = 14.5;

double ValueOf(ViewTrait trait, const Pose& X_CK, double time_s, bool late) {
  switch (trait) {
    case ViewTrait::kTime:
      return time_s;
    case ViewTrait::kLateHalf:
      return late ? 1 : 0;
    case ViewTrait::kDistance:
      return std::log(X_CK.p.norm());
    case ViewTrait::kTiltX:
      return X_CK.R(0, 2);
    case ViewTrait::kTiltY:
      return X_CK.R(1, 2);
    case ViewTrait::kTurn:
      return std::pow(X_CK.R(0, 0), 2) - std::pow(X_CK.R(1, 0), 2);
    case ViewTrait::kPlaceX:
      return X_CK.p.x() / X_CK.p.z();
    case ViewTrait::kPlaceY:
      return X_CK.p.y() / X_CK.p.z();
  }
  return 0;
}

/// The trait of each view from -1/2 to 1/2; empty if all are equal.
std::vector<double> WeightsOf(ViewTrait trait, const LensFit& fit,
                              std::span<const BoardView> views) {
  std::vector<double> w;
  for (std::size_t j = 0; j < views.size(); ++j)
    w.push_back(ValueOf(trait, fit.X_CK[j], views[j].time_s, 2 * j >= views.size()));
  const auto [low, high] = std::ranges::minmax(w);
  const double middle = 0.5 * (low + high), range = high - low;
  if (!(range > 1e-9)) return {};
  for (double& value : w) value = (value - middle) / range;
  return w;
}

LensMatrix LensPart(const SharedMatrix& matrix) {
  return matrix.topLeftCorner<kLensCount, kLensCount>();
}

/// What one trait does to the lens.
struct Effect {
  double chi2 = 0, effect_px = 0;
  LensMatrix covariance = LensMatrix::Zero();
};

Effect EffectOf(const LensFit& fit, const std::vector<double>& w, const LensMatrix& weight,
                const LensMatrix& prior, double widening) {
  const SharedMatrix C = CovarianceWithDroppedFixed(fit);
  SharedMatrix A = SharedMatrix::Zero(), square = SharedMatrix::Zero();
  SharedVector pull = SharedVector::Zero();
  for (std::size_t j = 0; j < w.size(); ++j) {
    A += w[j] * fit.view_information[j].information;
    square += w[j] * w[j] * fit.view_information[j].information;
    pull += w[j] * fit.view_information[j].pull;
  }
  LensMatrix V = LensPart(square - A * C * A) / widening + prior;
  LensVector S = pull.head<kLensCount>() / widening;
  for (int k = 0; k < kLensCount; ++k) {
    if (!fit.dropped[k]) continue;
    V.row(k).setZero();
    V.col(k).setZero();
    V(k, k) = prior(k, k);
    S[k] = 0;
  }
  // Scaled to units of the prior, since the parameters differ by many orders of magnitude.
  const LensVector scale = prior.diagonal().cwiseSqrt().cwiseInverse();
  const LensMatrix scaled_V = scale.asDiagonal() * V * scale.asDiagonal();
  const LensMatrix scaled_W = scale.asDiagonal() * weight * scale.asDiagonal();
  const Eigen::GeneralizedSelfAdjointEigenSolver<LensMatrix> directions(scaled_W, scaled_V);
  Effect effect;
  SharedVector d = SharedVector::Zero();
  for (int k = 0; k < kLensCount; ++k) {
    const LensVector u = scale.asDiagonal() * directions.eigenvectors().col(k);
    const double z = u.dot(S);
    if (!(z * z > kMinChi2)) continue;
    effect.chi2 += z * z;
    d.head<kLensCount>() += (z - 1 / z) * u;
  }
  if (effect.chi2 == 0) return effect;
  const LensVector change = d.head<kLensCount>();
  effect.effect_px = std::sqrt(std::max(0.0, change.dot(weight * change)));
  const SharedVector bias = C * A * d;
  const SharedVector high = 0.5 * d - bias, low = -0.5 * d - bias;
  const auto size_of = [&](const SharedVector& e) {
    const LensVector lens = e.head<kLensCount>();
    return lens.dot(weight * lens);
  };
  const LensVector e = (size_of(high) > size_of(low) ? high : low).head<kLensCount>();
  effect.covariance = e * e.transpose();
  return effect;
}

}  // namespace

std::optional<ViewDependence> DependenceOnViews(const LensFit& fit,
                                                std::span<const BoardView> views,
                                                const lens::Lens& lens, const target::Board& board,
                                                image::ImageSize size, double widening) {
  const LensMatrix weight = ProjectionWeight(lens, size).topLeftCorner<kLensCount, kLensCount>();
  const LensMatrix prior = LensPart(PriorInformation({}, board, size, fit.shared[kFy]));
  if (!weight.allFinite()) return std::nullopt;
  std::optional<ViewDependence> found;
  for (const ViewTrait trait : kTraits) {
    const std::vector<double> w = WeightsOf(trait, fit, views);
    if (w.empty()) continue;
    const Effect effect = EffectOf(fit, w, weight, prior, widening);
    if (effect.chi2 == 0) continue;
    if (found && effect.chi2 <= found->chi2) continue;
    found = ViewDependence{trait, effect.effect_px, effect.chi2, effect.covariance};
  }
  return found;
}

}  // namespace plumbline::vision
