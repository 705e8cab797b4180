#include "tests/simulator/noise.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

namespace plumbline::noise_test {

using namespace simulator;
using Eigen::Vector3d;

namespace {

constexpr double kSigma_m = 1e-4;

struct Errors {
  std::vector<Vector3d> truth_m, of_row;  ///< errors in units of sigma
  std::vector<int> outlier_lines;

  double MeanSquare() const {
    double sum = 0.0;
    for (const Vector3d& e : of_row) sum += e.squaredNorm();
    return sum / (3.0 * double(of_row.size()));
  }
};

/// Errors at random points of the arm's working space.
Errors Draw(const Noise& noise, int rows) {
  Cell cell = ReadyCell("kr210");
  cell.sigma_m = kSigma_m;
  Generator random(11);
  Errors errors;
  Table table;
  table.rows.resize(std::size_t(rows));
  for (int k = 0; k < rows; ++k) {
    errors.truth_m.emplace_back(Uniform(random, -2, 2), Uniform(random, -2, 2),
                                Uniform(random, 0, 2));
  }
  errors.outlier_lines = Measure(cell, noise, errors.truth_m, table, random);
  for (std::size_t k = 0; k < table.rows.size(); ++k) {
    errors.of_row.emplace_back((table.rows[k].xyz_m - errors.truth_m[k]) / kSigma_m);
  }
  return errors;
}

}  // namespace

TEST_CASE("every kind of noise has the cell's sigma over all rows") {
  CHECK(Draw(Noise{}, 20000).MeanSquare() == Approx(1.0).epsilon(0.03));
  Noise noise;
  noise.ar1 = 0.7;
  CHECK(Draw(noise, 20000).MeanSquare() == Approx(1.0).epsilon(0.05));
  noise = {};
  noise.tracker = true;
  CHECK(Draw(noise, 20000).MeanSquare() == Approx(1.0).epsilon(0.03));
}

TEST_CASE("correlated noise has the requested correlation between rows") {
  Noise noise;
  noise.ar1 = 0.7;
  const Errors errors = Draw(noise, 20000);
  double product = 0.0;
  for (std::size_t k = 1; k < errors.of_row.size(); ++k) {
    product += errors.of_row[k].dot(errors.of_row[k - 1]);
  }
  CHECK(product / (3.0 * double(errors.of_row.size())) == Approx(0.7).margin(0.03));
}

TEST_CASE("a tracker's noise is small along its beam and grows with the distance") {
  Noise noise;
  noise.tracker = true;
  const Errors errors = Draw(noise, 20000);
  const Vector3d tracker_m = CameraBeside(ReadyCell("kr210")).at_m;
  double along = 0.0, near = 0.0, far = 0.0;
  int count_near = 0, count_far = 0;
  for (std::size_t k = 0; k < errors.of_row.size(); ++k) {
    const Vector3d beam = errors.truth_m[k] - tracker_m;
    along += std::pow(beam.normalized().dot(errors.of_row[k]), 2) / double(errors.of_row.size());
    const bool is_near = beam.norm() < tracker_m.norm();
    (is_near ? near : far) += errors.of_row[k].squaredNorm();
    ++(is_near ? count_near : count_far);
  }
  CHECK(along < 0.15);
  CHECK(far / count_far > 1.2 * near / count_near);
}

TEST_CASE("outlier runs have the requested count, consecutive rows and one direction each") {
  Noise noise;
  noise.outliers = 0.15;
  noise.runs = true;
  const Errors errors = Draw(noise, 1000);
  REQUIRE(errors.outlier_lines.size() == 150);
  CHECK(std::is_sorted(errors.outlier_lines.begin(), errors.outlier_lines.end()));
  int runs = 1, alike = 0;
  for (std::size_t i = 1; i < errors.outlier_lines.size(); ++i) {
    const int line = errors.outlier_lines[i], before = errors.outlier_lines[i - 1];
    if (line != before + 1) {
      ++runs;
      continue;
    }
    const Vector3d& a = errors.of_row[std::size_t(line - 2)];
    const Vector3d& b = errors.of_row[std::size_t(before - 2)];
    alike += a.normalized().dot(b.normalized()) > 0.8 ? 1 : 0;
  }
  CHECK(runs <= 50);
  CHECK(alike >=
        150 - runs - 15);  // noise of one sigma changes the direction of ten-sigma outliers
}

}  // namespace plumbline::noise_test
