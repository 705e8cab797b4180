// Least squares with rows of different numbers of residuals and individual covariances.
#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <random>

#include "app/measure/diagnosis/data/observations.h"
#include "app/measure/diagnosis/linear/fit_problem.h"
#include "app/measure/diagnosis/linear/robust.h"

namespace plumbline::residual_layout_test {

using namespace plumbline::measure;

namespace {

constexpr double kSigma_m = 5e-5;

/// Rows that measure nothing, a range, a position, a pose whose numbers are correlated, and a
/// position that is less certain along one direction.
struct MixedRows {
  Dataset data;
  PerRow<RowResidual> residuals;
  PerRow<Eigen::MatrixXd> columns;  ///< of two parameters
  std::mt19937_64 generator{7};
  std::normal_distribution<double> normal;

  MixedRows() {
    for (int round = 0; round < 4; ++round) {
      Add({0, {}});
      Add({1, {}});
      Add({3, {}});
      Add({6, Correlated(6)});
      Add({3, Correlated(3)});
    }
    data.table.rows.resize(data.numbers.size());
  }

  double Draw() { return normal(generator); }
  Eigen::MatrixXd Random(int rows, int columns_of) {
    return Eigen::MatrixXd::NullaryExpr(rows, columns_of, [this] { return Draw(); });
  }
  /// Random, positive definite.
  Eigen::MatrixXd Correlated(int size) {
    const Eigen::MatrixXd A = Random(size, size);
    return A * A.transpose() + 0.5 * Eigen::MatrixXd::Identity(size, size);
  }
  void Add(const RowNumbers& numbers) {
    data.numbers.push_back(numbers);
    residuals.emplace_back(1e-4 * Random(numbers.count, 1));
    columns.push_back(Random(numbers.count, 2));
  }

  FitProblem Problem() {
    FitProblem problem{data, EveryRow(data), {}, kSigma_m, 1};
    for (const RowIndex row : data.row_indices()) {
      problem.weights.push_back(1.0 / (1 + row.value() % 3));
    }
    return problem;
  }
  /// Covariance of a row's residuals, its weight among it.
  Eigen::MatrixXd CovarianceOf(const FitProblem& problem, RowIndex row) const {
    const RowNumbers& numbers = data.numbers[row];
    const Eigen::MatrixXd unit = Eigen::MatrixXd::Identity(numbers.count, numbers.count);
    const Eigen::MatrixXd& relative = numbers.covariance.size() > 0 ? numbers.covariance : unit;
    return kSigma_m * kSigma_m / problem.weights[row] * relative;
  }
};

}  // namespace

TEST_CASE("each row has its own section, rows without a measurement have none") {
  ResidualLayout<FitRowIndex> layout;
  for (const int count : {3, 0, 1, 6}) layout.Add(count);
  CHECK(layout.total() == 10);
  CHECK(layout.first(FitRowIndex(1)) == 3);
  CHECK(layout.count(FitRowIndex(1)) == 0);
  CHECK(layout.first(FitRowIndex(2)) == 3);
  CHECK(layout.first(FitRowIndex(3)) == 4);
  Eigen::VectorXd stacked = Eigen::VectorXd::LinSpaced(10, 0, 9);
  CHECK(layout.PartOf(stacked, FitRowIndex(2))(0) == 3);
  layout.PartOf(stacked, FitRowIndex(3)).setZero();
  CHECK(stacked.tail<6>().isZero());
  CHECK(stacked[3] == 3);
}

TEST_CASE("whitened least squares equals generalised least squares with the full covariance") {
  MixedRows rows;
  const FitProblem problem = rows.Problem();
  const FitLayout layout = problem.layout();
  const Whitener whitener(problem);
  const int total = layout.total();
  REQUIRE(total == 4 * (0 + 1 + 3 + 6 + 3));
  Eigen::VectorXd y(total), white_y(total);
  Eigen::MatrixXd X(total, 2), white_X(total, 2);
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(total, total);
  for (const FitRowIndex j : problem.rows.indices()) {
    const RowIndex row = problem.rows[j];
    const int first = layout.first(j), count = layout.count(j);
    y.segment(first, count) = rows.residuals[row];
    X.middleRows(first, count) = rows.columns[row];
    covariance.block(first, first, count, count) = rows.CovarianceOf(problem, row);
    whitener[j].Apply(rows.residuals[row], layout.PartOf(white_y, j));
    whitener[j].Apply(rows.columns[row], layout.PartOf(white_X, j));
  }
  const Eigen::MatrixXd information = covariance.inverse();
  CHECK(white_y.squaredNorm() == Approx(y.dot(information * y)));
  const Eigen::MatrixXd normal = X.transpose() * information * X;
  CHECK((white_X.transpose() * white_X).isApprox(normal, 1e-10));
  const Eigen::VectorXd generalised = normal.inverse() * (X.transpose() * (information * y));
  const Eigen::VectorXd whitened = white_X.colPivHouseholderQr().solve(white_y);
  CHECK(whitened.isApprox(generalised, 1e-9));
}

TEST_CASE("the size of a residual is scaled by its covariance") {
  MixedRows rows;
  for (const RowIndex row : rows.data.row_indices()) {
    const RowNumbers& numbers = rows.data.numbers[row];
    const RowResidual& r = rows.residuals[row];
    const double square =
        numbers.covariance.size() == 0 ? r.dot(r) : r.dot(numbers.covariance.inverse() * r);
    CHECK(SizeOf(numbers, r) == Approx(std::sqrt(square)));
  }
}

TEST_CASE("the robust sigma is recovered for all kinds of rows, with hardly any reduced weight") {
  MixedRows rows;
  Dataset data;
  PerRow<RowResidual> residuals;
  for (int k = 0; k < 4000; ++k) {
    const RowNumbers& numbers = rows.data.numbers[RowIndex(k % rows.data.numbers.count())];
    data.numbers.push_back(numbers);
    Eigen::MatrixXd noise = kSigma_m * rows.Random(numbers.count, 1);
    if (numbers.covariance.size() > 0) {
      noise = Eigen::LLT<Eigen::MatrixXd>(numbers.covariance).matrixL() * noise;
    }
    residuals.emplace_back(noise);
  }
  CHECK(RobustSigma(data, residuals) == Approx(kSigma_m).epsilon(0.03));
  CHECK(OutlierScale(data, residuals, kSigma_m) == kSigma_m);
  const PerRow<double> weights = HampelWeights(data, residuals, kSigma_m);
  int fallen = 0;
  for (const RowIndex row : residuals.indices()) {
    const bool measures = data.numbers[row].count > 0;
    if (measures) fallen += weights[row] < 1;
    if (!measures) CHECK(weights[row] == 0);  // nothing was measured
  }
  CHECK(fallen <= 8);  // one in 2000 expected; 3200 rows have a measurement
}

TEST_CASE("one row in seven far from the model is an effect, not an outlier") {
  MixedRows rows;
  Dataset data;
  PerRow<RowResidual> residuals;
  for (int k = 0; k < 400; ++k) {
    data.numbers.push_back({3, {}});
    residuals.emplace_back(kSigma_m * rows.Random(3, 1));
  }
  const auto with_far_rows = [&](int every) {
    PerRow<RowResidual> some = residuals;
    for (const RowIndex row : some.indices()) {
      if (row.value() % every == 0) some[row] = RowResidual(Vec3(0.03, 0, 0));
    }
    return OutlierScale(data, some, kSigma_m);
  };
  CHECK(with_far_rows(15) == kSigma_m);
  CHECK(with_far_rows(7) > 1e-3);
}

TEST_CASE("the error of a row is that of its position, or along the ray of a range") {
  CHECK(LengthsOf(RowResidual()) == Vec3::Zero());
  CHECK(LengthsOf(RowResidual::Constant(1, 2e-3)) == Vec3(2e-3, 0, 0));
  CHECK(LengthsOf(RowResidual::LinSpaced(6, 1, 6)) == Vec3(1, 2, 3));
}

}  // namespace plumbline::residual_layout_test
