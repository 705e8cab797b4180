// Detection of the joint resolution from readings written to a file.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "app/measure/diagnosis/preparation/dataset_noise.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::joint_step_test {

using namespace plumbline::measure;

namespace {

/// Detects the step of `rows` random joint readings, rounded to `step_deg` and written with
/// `decimals`.
std::optional<JointStep> StepOfFile(double step_deg, int decimals, int rows, unsigned seed = 1) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> anywhere(-170, 170);
  std::string text = "q1_deg,q2_deg\n";
  for (int k = 0; k < rows; ++k) {
    double q[2];
    for (double& angle : q) {
      angle = anywhere(generator);
      if (step_deg > 0) angle = step_deg * std::round(angle / step_deg);
    }
    text += fmt::format("{:.{}f},{:.{}f}\n", q[0], decimals, q[1], decimals);
  }
  config::FaultList faults;
  const std::vector<model::Joint> joints(2);
  const auto table = measure::TableFromCsv(text, "measured.csv", joints, faults);
  REQUIRE(table);
  REQUIRE(table->q_decimals == decimals);
  return JointStepOf(*table, joints);
}

}  // namespace

TEST_CASE("the step of a controller is found although the file has more decimals") {
  constexpr double kMilliradian_deg = 1e-3 / kRadPerDeg;
  for (const double step_deg :
       {0.1, 0.05, 0.02, 0.01, kMilliradian_deg, 0.1 * kMilliradian_deg, 360.0 / 4096}) {
    CAPTURE(step_deg);
    const auto step = StepOfFile(step_deg, 4, 20);
    REQUIRE(step);
    CHECK(step->step_rad / kRadPerDeg == Approx(step_deg));
    CHECK_FALSE(step->as_written);
    CHECK(step->log10_chance < -6);
    CHECK(step->readings > 30);
  }
}

TEST_CASE("continuous readings have only the step of the file") {
  for (unsigned seed = 1; seed <= 200; ++seed) {
    CAPTURE(seed);
    const auto step = StepOfFile(0, 3, 12, seed);
    REQUIRE(step);
    CHECK(step->as_written);
    CHECK(step->step_rad / kRadPerDeg == Approx(1e-3));
  }
}

TEST_CASE("few rows are no evidence, and poses at whole degrees are not a controller step") {
  const auto few = StepOfFile(0.1, 2, 2);
  REQUIRE(few);
  CHECK(few->as_written);  // four readings with probability 0.1 each: may be chance
  CHECK_FALSE(StepOfFile(1.0, 3, 20));
  CHECK_FALSE(StepOfFile(5.0, 3, 20));
  CHECK_FALSE(StepOfFile(0, 0, 20));  // whole degrees in the file: commanded
}

TEST_CASE("no step is reported if the decimals are unknown") {
  config::FaultList faults;
  const std::vector<model::Joint> joints(1);
  const auto table = measure::TableFromCsv("q1_deg\n1.5e1\n2.5\n", "measured.csv", joints, faults);
  REQUIRE(table);
  CHECK_FALSE(table->q_decimals);
  CHECK_FALSE(JointStepOf(*table, joints));
  CHECK_FALSE(JointStepOf(measure::MeasuredTable{}, joints));
}

}  // namespace plumbline::joint_step_test
