#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <random>

#include "app/measure/plan/measurement_plan.h"

namespace plumbline::d_optimal_test {

using namespace plumbline::measure;

TEST_CASE("the selection reaches the best of all subsets of a small set") {
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 5; ++trial) {
    std::vector<Eigen::MatrixXd> rows;
    for (int i = 0; i < 10; ++i) {
      rows.push_back(Eigen::MatrixXd::NullaryExpr(1, 4, [&] { return 5 * normal(random); }));
    }
    double best = -1e300;
    for (unsigned subset = 0; subset < 1024; ++subset) {
      Eigen::MatrixXd H = Eigen::MatrixXd::Identity(4, 4);
      int count = 0;
      for (unsigned i = 0; i < 10; ++i) {
        if ((subset >> i & 1U) == 0) continue;
        H += rows[i].transpose() * rows[i];
        ++count;
      }
      if (count == 5) best = std::max(best, std::log(H.determinant()));
    }
    const std::vector<int> selected = DOptimalRows(rows, 5, 10);
    CHECK(selected.size() == 5);
    const double reached = std::log(Information(rows, selected).determinant());
    CHECK(reached > best - 0.05);
    CHECK(LogDeterminant(Information(rows, selected)) == Approx(reached));
  }
}

TEST_CASE("more rows than there are gives all of them") {
  const std::vector<Eigen::MatrixXd> rows(3, Eigen::MatrixXd::Ones(1, 2));
  CHECK(DOptimalRows(rows, 9, 2).size() == 3);
}

}  // namespace plumbline::d_optimal_test
