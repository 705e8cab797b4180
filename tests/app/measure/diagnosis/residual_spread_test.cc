// Variance model of held-out errors near the measured rows and far from them.
#include "app/measure/diagnosis/prediction/residual_spread.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "app/measure/diagnosis/validation/farthest_poses.h"

namespace plumbline::residual_spread_test {

using namespace plumbline::measure;

namespace {

constexpr int kRows = 300;
constexpr double kSigma_m = 5e-5;

/// Rows with three residuals each.
Dataset Points() {
  Dataset data;
  data.numbers.assign(kRows, {3, {}});
  return data;
}

const Dataset kPoints = Points();

FitProblem Problem() {
  return {kPoints, {}, PerRow<double>(kRows, 1.0), kSigma_m, 1};
}

/// Rows in five folds with normal errors of variance near^2 + (distant d)^2, d within `low..high`.
HeldOut Drawn(const std::string& by, double near_m, double distant_m, double low, double high,
              unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> distance(low, high);
  HeldOut scheme;
  scheme.by = by;
  for (int row = 0; row < kRows; ++row) {
    const double d = distance(random), sigma_m = std::hypot(near_m, distant_m * d);
    scheme.fold_of.push_back(row % 5);
    scheme.distance.push_back(d);
    scheme.after.emplace_back(sigma_m * normal(random), sigma_m * normal(random),
                              sigma_m * normal(random));
    scheme.before.push_back(2 * scheme.after.back());
  }
  scheme.predicted.assign(kRows, true);
  scheme.reach.assign(kRows, 0.0);
  scheme.beyond.assign(kRows, BeyondRanges::Zero());
  return scheme;
}

Validation Drawn(double near_m, double distant_m) {
  Validation validation;
  validation.schemes = {
      Drawn("blocks of time", near_m, distant_m, 0.1, 0.4, 1),
      Drawn("regions of the joint space", near_m, distant_m, 0.3, 1.5, 2),
  };
  return validation;
}

ResidualSpread Spread(const Validation& validation, Correction correction = Correction::kWritten) {
  return SpreadOf(validation, Problem(), correction).value();
}

double Growth(const ResidualSpread& spread, ModelInput input) {
  return spread.growth_m[static_cast<int>(input)];
}

}  // namespace

TEST_CASE("the growth with the distance is estimated, of the correction or without it") {
  const ResidualSpread spread = Spread(Drawn(1e-4, 3e-4));
  CHECK(spread.near_m == Approx(1e-4).epsilon(0.2));
  CHECK(spread.distant_m == Approx(3e-4).epsilon(0.1));
  const ResidualSpread declared = Spread(Drawn(1e-4, 3e-4), Correction::kNone);
  CHECK(declared.distant_m == Approx(2 * spread.distant_m).epsilon(0.1));
}

TEST_CASE("the growth along an input that no fold tests is the prior's") {
  // All components are widened alike.
  const Validation validation = Drawn(1e-4, 0);
  const ResidualSpread confirmed = Spread(validation);
  double declared_m2 = 0;  // of the declared model on one axis, in the held-out regions
  for (const Vec3& before : validation.schemes[1].before)
    declared_m2 += before.squaredNorm() / (3 * kRows);
  const ResidualSpread fading = Spread(validation, Correction::kFading);
  CHECK(Growth(confirmed, ModelInput::kRange) >= kSigma_m);
  // With the caution of the regions, as the posture.
  CHECK(Growth(fading, ModelInput::kRange) >= Growth(fading, ModelInput::kTorque));
  for (const ModelInput input :
       {ModelInput::kTorque, ModelInput::kPayload, ModelInput::kTemperature}) {
    CHECK(Growth(confirmed, input) >= kSigma_m);  // a confirmed law extrapolates within the noise
    CHECK(Growth(confirmed, input) < 1.2 * kSigma_m);
    CHECK(Growth(fading, input) / fading.declared_m.value() ==
          Approx(std::sqrt(1 + kSigma_m * kSigma_m / declared_m2)));
  }
}

TEST_CASE("held-out rows beyond an input's range override the prior, along this input only") {
  constexpr double kGrowth_m = 5e-4;
  const auto beyond = [](int every) {
    Validation validation = Drawn(1e-4, 0);
    HeldOut& regions = validation.schemes[1];
    for (const RowIndex row : FirstIndices<RowIndex>(kRows)) {
      if (row.value() % every != 0) continue;
      regions.beyond[row][static_cast<int>(ModelInput::kPayload)] = 1;
      regions.after[row] *= std::hypot(1e-4, kGrowth_m) / 1e-4;
    }
    return Spread(validation);
  };
  const ResidualSpread tested = beyond(1);
  CHECK(Growth(tested, ModelInput::kPayload) > 0.9 * kGrowth_m);
  CHECK(Growth(tested, ModelInput::kPayload) < 1.2 * kGrowth_m);
  CHECK(Growth(tested, ModelInput::kTorque) < 1.3 * kSigma_m);
  CHECK(tested.near_m < 1.3e-4);
  // A single fold weighs as much as the prior: the growth is halfway between both variances.
  const ResidualSpread once = beyond(5);
  const double widened = Growth(once, ModelInput::kTorque) / kSigma_m;
  CHECK(Growth(once, ModelInput::kPayload) / widened ==
        Approx(std::sqrt((kGrowth_m * kGrowth_m + kSigma_m * kSigma_m) / 2)).epsilon(0.2));
}

TEST_CASE("along time, only the error of an answer that follows it grows") {
  constexpr double kDrift_m = 3e-4;
  const ResidualSpread still = Spread(Drawn(1e-4, 0));
  const ResidualSpread drifting =
      SpreadOf(Drawn(1e-4, 0), Problem(), Correction::kWritten, kDrift_m).value();
  CHECK(Growth(still, ModelInput::kTime) == 0);
  CHECK(Growth(drifting, ModelInput::kTemperature) ==
        Approx(Growth(still, ModelInput::kTemperature)));
  CHECK(Growth(drifting, ModelInput::kTime) / Growth(drifting, ModelInput::kTemperature) ==
        Approx(std::hypot(kSigma_m, kDrift_m / std::sqrt(3)) / kSigma_m));
}

TEST_CASE("errors that do not grow give a constant spread, never below the noise") {
  const ResidualSpread spread = Spread(Drawn(1e-4, 0));
  CHECK(spread.near_m == Approx(1e-4).epsilon(0.1));
  CHECK(spread.distant_m < 0.6 * spread.near_m);
  CHECK(Spread(Drawn(1e-5, 0)).near_m == Approx(kSigma_m));
}

TEST_CASE("errors that the distance does not explain are expected everywhere") {
  Validation validation = Drawn(1e-4, 0);
  for (HeldOut& scheme : validation.schemes) scheme.distance.assign(kRows, 0.5);
  for (Vec3& error : validation.schemes[1].after) error *= 5;
  const ResidualSpread spread = Spread(validation);
  CHECK(std::hypot(spread.near_m, 0.5 * spread.distant_m) > 5e-4);
}

TEST_CASE("correlated errors within a fold count as fewer independent rows") {
  // The same errors twice: a tenth of the rows have four times the error of the others, either
  // spread over all folds or concentrated in few.
  std::mt19937 random(6);
  std::normal_distribution<double> normal;
  HeldOut spread = Drawn("regions of the joint space", 1e-4, 0, 0.5, 0.5, 5);
  HeldOut together = spread;
  for (int row = 0; row < kRows; ++row) {
    const RowIndex index(row);
    const double sigma_m = row < kRows / 10 ? 4e-4 : 1e-4;
    spread.after[index] = {sigma_m * normal(random), sigma_m * normal(random),
                           sigma_m * normal(random)};
    together.after[index] = spread.after[index];
    spread.fold_of[index] = row % 20;
    together.fold_of[index] = row / (kRows / 20);
  }
  const auto radius = [](const HeldOut& scheme) {
    Validation validation;
    validation.schemes = {Drawn("blocks of time", 1e-4, 0, 0.5, 0.5, 1), scheme};
    const ResidualSpread found = Spread(validation);
    return std::hypot(found.near_m, 0.5 * found.distant_m);
  };
  CHECK(radius(together) > 1.1 * radius(spread));
}

TEST_CASE("a fading correction is tested as it will be applied, including between halves") {
  constexpr double kDeclared_m = 5e-4, kReach = 0.2;
  std::mt19937 random(4);
  std::normal_distribution<double> normal(0, kDeclared_m);
  Validation validation = Drawn(1e-4, 1e-4);
  validation.halves = Drawn("opposite halves of the joint space", 1e-4, 1e-3, 0.3, 1.5, 3);
  std::vector<HeldOut*> every = {&validation.schemes[0], &validation.schemes[1],
                                 &*validation.halves};
  for (HeldOut* scheme : every) {
    scheme->reach.assign(kRows, kReach);
    for (Vec3& before : scheme->before)
      before = Vec3(normal(random), normal(random), normal(random));
  }
  const ResidualSpread written = Spread(validation);
  CHECK_FALSE(written.declared_m);
  CHECK(written.distant_m < 2e-4);
  const ResidualSpread fading = Spread(validation, Correction::kFading);
  CHECK(fading.distant_m > 4e-4);  // estimated from the halves
  REQUIRE(fading.declared_m);
  CHECK(*fading.declared_m > 0.9 * kDeclared_m);
  // With the applied share, the errors at the far end of the halves are within the radius.
  const double declared_m2 = *fading.declared_m * *fading.declared_m;
  int outside = 0;
  for (const RowIndex row : FirstIndices<RowIndex>(kRows)) {
    const HeldOut& halves = *validation.halves;
    const double gained_m2 = fading.distant_m * fading.distant_m *
                             (halves.distance[row] * halves.distance[row] - kReach * kReach);
    const double share = declared_m2 / (declared_m2 + gained_m2);
    const Vec3 error = halves.before[row] + share * (halves.after[row] - halves.before[row]);
    const double variance_m2 = fading.near_m * fading.near_m + share * gained_m2;
    outside += error.squaredNorm() > 7.815 * variance_m2 ? 1 : 0;
  }
  CHECK(outside < 0.08 * kRows);
}

TEST_CASE("without a held-out region or session there is no spread") {
  Validation validation = Drawn(1e-4, 0);
  validation.schemes.pop_back();
  CHECK_FALSE(SpreadOf(validation, Problem(), Correction::kWritten));
}

TEST_CASE("differences between sessions count near the measured poses, too") {
  Validation validation = Drawn(1e-4, 0);
  validation.schemes.push_back(Drawn("sessions", 5e-4, 0, 0.1, 0.4, 3));
  validation.schemes.back().other_sessions = true;
  CHECK(Spread(validation).near_m > 5e-4);
  CHECK(Spread(validation).near_m < 8e-4);
}

TEST_CASE(
    "a radius leaves out only what 95 % allow with a confidence of 80 %, rejected rows included") {
  Validation validation = Drawn(1e-4, 0);
  FitProblem problem = Problem();
  const auto set_errors = [&](int every) {
    for (HeldOut& scheme : validation.schemes) {
      for (const RowIndex row : FirstIndices<RowIndex>(kRows)) {
        const bool off = row.value() % every == 0;
        scheme.after[row] = Vec3(off ? 8e-4 : 1e-4, 0, 0);
        problem.weights[row] = off ? 0 : 1;
      }
    }
    return std::sqrt(7.815) * SpreadOf(validation, problem, Correction::kWritten).value().near_m;
  };
  CHECK(set_errors(10) == Approx(8e-4).epsilon(0.05));  // every tenth row is an outlier
  CHECK(set_errors(31) < 3e-4);                         // 10 of 300: P(X <= 10) is 0.11
  CHECK(set_errors(23) == Approx(8e-4).epsilon(0.05));  // 14 of 300: P(X <= 14) is 0.46
}

TEST_CASE("noise that some rows state in excess is not the model's and does not widen the radius") {
  Validation validation = Drawn(1e-4, 0);
  Dataset data = Points();
  constexpr double kNoisier = 10;
  for (const RowIndex row : FirstIndices<RowIndex>(kRows)) {
    if (row.value() % 2 == 0) continue;
    data.numbers[row].covariance = kNoisier * kNoisier * Eigen::Matrix3d::Identity();
    const double grown = std::sqrt(1 + (kNoisier * kNoisier - 1) * std::pow(kSigma_m / 1e-4, 2));
    for (HeldOut& scheme : validation.schemes) scheme.after[row] *= grown;
  }
  const FitProblem problem{data, {}, PerRow<double>(kRows, 1.0), kSigma_m, 1};
  const ResidualSpread spread = SpreadOf(validation, problem, Correction::kWritten).value();
  CHECK(spread.near_m == Approx(1e-4).epsilon(0.25));
}

TEST_CASE("rejected rows widen the radius, however far they are from the model") {
  Validation validation = Drawn(1e-4, 0);
  FitProblem problem = Problem();
  for (const RowIndex row : FirstIndices<RowIndex>(kRows)) {
    if (row.value() % 15 != 0) continue;  // 6.7 %, more than a 95 % radius excludes
    problem.weights[row] = 0;
    for (HeldOut& scheme : validation.schemes) scheme.after[row] = Vec3(0.4, -0.3, 0.2);
  }
  const ResidualSpread spread = SpreadOf(validation, problem, Correction::kWritten).value();
  CHECK(spread.near_m > 0.05);
}

TEST_CASE("farthest-point selection spreads the columns and selects none twice") {
  Eigen::MatrixXd points(1, 6);
  points << 0, 1, 1, 2, 10, 5;
  const std::vector<Eigen::Index> chosen = FarthestColumns(points, 10);
  REQUIRE(chosen.size() == 5);
  CHECK(points(0, chosen[0]) == 2);  // nearest to the mean, 3.2
  CHECK(points(0, chosen[1]) == 10);
  CHECK(points(0, chosen[2]) == 5);
  CHECK(FarthestColumns(points, 2).size() == 2);
  CHECK(FarthestColumns(Eigen::MatrixXd(1, 0), 2).empty());
}

}  // namespace plumbline::residual_spread_test
