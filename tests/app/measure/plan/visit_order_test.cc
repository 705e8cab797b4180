#include "app/measure/plan/visit_order.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <numeric>
#include <random>

namespace plumbline::visit_order_test {

using namespace plumbline::measure;

namespace {

std::vector<model::JointVector> Postures(unsigned seed, int count) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-2, 2);
  std::vector<model::JointVector> postures;
  for (int k = 0; k < count; ++k) {
    model::JointVector q(3);
    for (double& value : q) value = uniform(random);
    postures.push_back(q);
  }
  return postures;
}

const auto kFree = [](std::size_t, std::size_t) { return true; };

}  // namespace

TEST_CASE("the order visits each posture once and is nearly the shortest of a few") {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const std::vector<model::JointVector> postures = Postures(seed, 7);
    std::vector<std::size_t> order(7);
    std::iota(order.begin(), order.end(), std::size_t{0});
    double best = 1e300;
    do best = std::min(best, PathCost(postures, order, {}));
    while (std::next_permutation(order.begin(), order.end()));
    std::vector<std::size_t> found = VisitOrder(postures, {}, kFree);
    CHECK(PathCost(postures, found, {}) < 1.15 * best);
    std::sort(found.begin(), found.end());
    for (std::size_t k = 0; k < found.size(); ++k) CHECK(found[k] == k);
  }
}

TEST_CASE("forty postures take less than half of the way of a random order") {
  const std::vector<model::JointVector> postures = Postures(9, 40);
  std::vector<std::size_t> as_drawn(40);
  std::iota(as_drawn.begin(), as_drawn.end(), std::size_t{0});
  const double ordered = PathCost(postures, VisitOrder(postures, {}, kFree), {});
  CHECK(ordered < 0.5 * PathCost(postures, as_drawn, {}));
}

TEST_CASE("speeds decide what a move costs, and moves that are not free are avoided") {
  model::JointVector from(2), to(2), speeds(2);
  from << 0, 0;
  to << 1, -0.5;
  speeds << 2, 0.1;
  CHECK(MoveCost(from, to, {}) == 1);
  CHECK(MoveCost(from, to, speeds) == Approx(5));

  // Even and odd postures are separated by an obstacle, which is crossed once.
  const std::vector<model::JointVector> postures = Postures(4, 12);
  const auto same_side = [](std::size_t a, std::size_t b) { return a % 2 == b % 2; };
  const std::vector<std::size_t> order = VisitOrder(postures, {}, same_side);
  int crossings = 0;
  for (std::size_t k = 1; k < order.size(); ++k) {
    crossings += same_side(order[k - 1], order[k]) ? 0 : 1;
  }
  CHECK(crossings == 1);
}

}  // namespace plumbline::visit_order_test
