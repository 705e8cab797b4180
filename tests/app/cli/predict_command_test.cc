// Predictions against another simulator's answers, where the recorded sets are there.
#include "app/cli/predict_command.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "app/config/cell_reader.h"

using namespace plumbline;

TEST_CASE("example-03 hides nothing: the declared model meets it to its last digits") {
  const char* folder = std::getenv("PLUMBLINE_MEASURED");
  const std::string set =
      std::string(folder != nullptr ? folder : "../shared/measured") + "/example-03";
  if (!std::filesystem::exists(set)) {
    WARN("SKIPPED: " << set << " is not there (set PLUMBLINE_MEASURED)");
    return;
  }
  FaultList faults;
  const auto cell = ReadCell(set + "/cell.toml", faults);
  REQUIRE(cell);
  const auto poses = ReadTable(set + "/test_poses.csv", cell->robot.joints, faults);
  const auto measured = ReadTable(set + "/measured.csv", cell->robot.joints, faults);
  REQUIRE(poses);
  REQUIRE(measured);

  const auto predicted = Predict(*cell, *poses, 0.1);
  REQUIRE(predicted.ok());
  std::ifstream truth(set + "/test_truth.csv");
  std::string header;
  std::getline(truth, header);
  double square_sum = 0, largest = 0;
  for (const Prediction& prediction : *predicted) {
    double x = 0, y = 0, z = 0;
    char comma = 0;
    truth >> x >> comma >> y >> comma >> z;
    const double error_mm = (1e3 * prediction.p_WT - Vec3(x, y, z)).norm();
    square_sum += error_mm * error_mm;
    largest = std::max(largest, error_mm);
  }
  CHECK(std::sqrt(square_sum / static_cast<double>(predicted->size())) < 4e-4);
  CHECK(largest < 1e-3);

  const auto fitted = Predict(*cell, *measured, 0.1);
  REQUIRE(fitted.ok());
  double residual = 0;
  for (std::size_t k = 0; k < fitted->size(); ++k) {
    residual += ((*fitted)[k].p_WT - measured->rows[k].p_WT).squaredNorm();
  }
  CHECK(1e3 * std::sqrt(residual / static_cast<double>(fitted->size())) ==
        Approx(0.087).margin(0.005));
}
