#include <Eigen/Cholesky>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "app/measure/diagnosis/search/discrepancy.h"

namespace plumbline::shrinkage_test {

using namespace plumbline::measure;

namespace {

constexpr int kRows = 400, kColumns = 60;

/// Two groups of thirty columns, the first with non-zero coefficients, the second with zeros; unit
/// noise.
struct Case {
  Eigen::MatrixXd X{kRows, kColumns};
  Eigen::VectorXd truth{kColumns}, y{kRows};
  std::vector<int> group;

  Case(double size, unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    for (int k = 0; k < kColumns; ++k) {
      for (int j = 0; j < kRows; ++j) X(j, k) = normal(random);
      truth[k] = k < kColumns / 2 ? size * normal(random) : 0;
      group.push_back(k < kColumns / 2 ? 0 : 1);
    }
    y = X * truth;
    for (int j = 0; j < kRows; ++j) y[j] += normal(random);
  }
  NormalEquations Equations() const {
    return {X.transpose() * X, X.transpose() * y, y.squaredNorm(), kRows};
  }
};

/// 2 ln(marginal likelihood) relative to noise alone, directly from the covariance of y.
double GainOf(const Case& of, const ShrunkenFit& fit) {
  Eigen::VectorXd ratio(kColumns);
  for (int k = 0; k < kColumns; ++k) ratio[k] = fit.ratio[of.group[static_cast<std::size_t>(k)]];
  const Eigen::MatrixXd covariance =
      Eigen::MatrixXd::Identity(kRows, kRows) + of.X * ratio.asDiagonal() * of.X.transpose();
  const Eigen::LLT<Eigen::MatrixXd> cholesky(covariance);
  const double left = of.y.dot(cholesky.solve(of.y));
  const Eigen::MatrixXd L = cholesky.matrixL();
  return kRows * std::log(of.y.squaredNorm() / left) - 2 * L.diagonal().array().log().sum();
}

}  // namespace

TEST_CASE("shrinkage estimates the variances of the groups and the noise") {
  const Case of(0.3, 5);
  const ShrunkenFit fit = Shrink(of.Equations(), of.group, {}, true);
  CHECK(std::sqrt(fit.noise) == Approx(1).epsilon(0.08));
  CHECK(std::sqrt(fit.ratio[0] * fit.noise) ==
        Approx(of.truth.head(30).norm() / std::sqrt(30.0)).epsilon(0.1));
  CHECK(std::sqrt(fit.ratio[1] * fit.noise) < 0.05);
  CHECK(fit.effective_parameters[0] > 25);
  const NormalEquations equations = of.Equations();
  const Eigen::VectorXd plain = equations.gram.ldlt().solve(equations.moment);
  CHECK(fit.values.tail(30).norm() < 0.5 * plain.tail(30).norm());
  CHECK(fit.gain == Approx(GainOf(of, fit)).epsilon(1e-6));
}

TEST_CASE("a shrunken fit is closer to the truth than least squares, with a correct covariance") {
  double shrunk = 0, plain = 0, said = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const Case of(0.05, seed);
    const NormalEquations equations = of.Equations();
    const ShrunkenFit fit = Shrink(equations, of.group, {}, true);
    shrunk += (fit.values - of.truth).squaredNorm();
    plain += (equations.gram.ldlt().solve(equations.moment) - of.truth).squaredNorm();
    said += fit.covariance.trace();
  }
  CHECK(shrunk < 0.6 * plain);
  CHECK(said == Approx(shrunk).epsilon(0.3));
}

TEST_CASE("noise alone gives a negligible gain") {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const Case of(0, seed);
    const ShrunkenFit fit = Shrink(of.Equations(), of.group, {}, false);
    CHECK(fit.gain < 10);  // two variances at their bounds: above 10 once in a thousand
    CHECK(fit.values.allFinite());
  }
}

TEST_CASE("shrinkage without columns or response gives zero") {
  const ShrunkenFit fit = Shrink({Eigen::MatrixXd(0, 0), Eigen::VectorXd(0), 3, 3}, {}, {}, true);
  CHECK(fit.values.size() == 0);
  CHECK(fit.gain == 0);
}

}  // namespace plumbline::shrinkage_test
