#include "app/measure/diagnosis/linear/support_fit.h"

#include <Eigen/QR>
#include <catch2/catch.hpp>
#include <random>

namespace plumbline::support_fit_test {

using namespace plumbline::measure;

namespace {

/// Moderately correlated columns of unit length, and a response.
struct Problem {
  Eigen::MatrixXd X;
  Eigen::VectorXd y;

  explicit Problem(unsigned seed) : X(40, 6), y(40) {
    std::mt19937 random(seed);
    std::normal_distribution<double> draw;
    for (double& value : X.reshaped()) value = draw(random);
    X.col(5) += 2 * X.col(0);
    X.colwise().normalize();
    for (double& value : y) value = draw(random);
    y += 8 * X.col(0) + 5 * X.col(3);
  }
  SupportFit Fit(double cost) const {
    return SupportFit(X.transpose() * X, X.transpose() * y, y.squaredNorm(),
                      {{BlockIndex(0), 0, {0, 1}, cost},
                       {BlockIndex(0), 1, {2}, cost},
                       {BlockIndex(1), 0, {3, 4}, cost},
                       {BlockIndex(2), 0, {5}, cost}});
  }
  /// chi2 of the columns at `places` by themselves, by QR.
  double Chi2(const std::vector<int>& places) const {
    if (places.empty()) return y.squaredNorm();
    const Eigen::MatrixXd part = X(Eigen::all, places);
    return (y - part * part.colPivHouseholderQr().solve(y)).squaredNorm();
  }
};

TEST_CASE("after elimination the result is the least squares fit of the kept columns") {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const Problem problem(seed);
    constexpr double kCost = 6;
    SupportFit fit = problem.Fit(kCost);
    CHECK(fit.minimum() == Approx(problem.Chi2({0, 1, 2, 3, 4, 5})));
    fit.Eliminate();
    const std::vector<int> places = fit.Places();
    CHECK(fit.minimum() == Approx(problem.Chi2(places)));
    const Eigen::MatrixXd part = problem.X(Eigen::all, places);
    const Eigen::VectorXd values = part.colPivHouseholderQr().solve(problem.y);
    for (std::size_t i = 0; i < places.size(); ++i) {
      CHECK(fit.Value(places[i]) == Approx(values[static_cast<int>(i)]));
    }
    // Each kept unit is worth its cost.
    for (const SupportFit::Unit& gone : fit.units()) {
      std::vector<int> others;
      for (const int place : places) {
        const bool of_unit =
            std::find(gone.places.begin(), gone.places.end(), place) != gone.places.end();
        if (!of_unit) others.push_back(place);
      }
      CHECK(problem.Chi2(others) - fit.minimum() >= kCost);
    }
  }
}

TEST_CASE("all units are eliminated if each costs more than it gains") {
  const Problem problem(3);
  SupportFit fit = problem.Fit(1e6);
  fit.Eliminate();
  CHECK(fit.units().empty());
  CHECK(fit.Places().empty());
  CHECK(fit.minimum() == Approx(problem.y.squaredNorm()));
}

TEST_CASE("among units with values out of bounds, the one that explains least is dropped first") {
  const Problem problem(3);
  SupportFit fit = problem.Fit(0);
  const std::vector<model::Interval> any(6, model::Interval{-1e300, 1e300});
  CHECK_FALSE(fit.DropOutOfBounds(any));
  // Columns 2 and 3 contribute about 0 and 5 to chi2.
  std::vector<model::Interval> bounds = any;
  for (const int place : {2, 3}) {
    const double value = fit.Value(place);
    bounds[static_cast<std::size_t>(place)] =
        value > 0 ? model::Interval{-1e300, 0} : model::Interval{0, 1e300};
  }
  REQUIRE(fit.DropOutOfBounds(bounds));
  CHECK(fit.Places() == std::vector<int>{0, 1, 3, 4, 5});
  CHECK(fit.minimum() == Approx(problem.Chi2({0, 1, 3, 4, 5})));
  REQUIRE(fit.DropOutOfBounds(bounds));
  CHECK(fit.Places() == std::vector<int>{0, 1, 5});  // 4 belongs to the unit of 3
  CHECK(fit.minimum() == Approx(problem.Chi2({0, 1, 5})));
  CHECK_FALSE(fit.DropOutOfBounds(bounds));
}

}  // namespace
}  // namespace plumbline::support_fit_test
