// A URDF text made into a cell as `plumbline import-urdf` does it, and compared with its XML.
#pragma once

#include <catch2/catch.hpp>

#include "app/base/config/cell_reader.h"
#include "app/measure/urdf/cell_text.h"
#include "app/measure/urdf/dh_table.h"
#include "firmware-like/kinematics/chain.h"
#include "tests/app/measure/urdf/oracle.h"

namespace plumbline::test {

struct Imported {
  measure::JointChain chain;
  model::CellModel cell;  ///< read back from its text
};

inline Imported Import(const std::string& xml, const std::string& base = "",
                       const std::string& tip = "tip") {
  config::FaultList faults;
  const auto file = measure::UrdfFromText(xml, "robot.urdf", faults);
  INFO(config::FaultsText(faults));
  REQUIRE(file);
  const auto chain =
      measure::ChainFromUrdf(*file, "robot.urdf", base, tip, measure::Rising::kIgnored, faults);
  INFO(xml << config::FaultsText(faults));
  REQUIRE(chain);
  const std::string text = measure::CellText(measure::RobotFromChain(*chain), *chain, "robot.urdf");
  const auto cell = config::CellFromText(text, "cell.toml", faults);
  INFO(text << config::FaultsText(faults));
  REQUIRE(cell);
  return {*chain, *cell};
}

/// Compares flange poses over random postures with 1e-6 mm and 1e-6 degrees.
inline void CheckAgainstXml(const std::string& xml, const Imported& imported, int postures,
                            std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-2.5, 2.4);
  const kinematics::Chain table(imported.cell.robot);
  double farthest_m = 0, largest_rad = 0;
  for (int k = 0; k < postures; ++k) {
    std::map<std::string, double> by_name;
    model::JointVector q(imported.cell.robot.size());
    for (int i = 0; i < q.size(); ++i) {
      q[i] = uniform(random);
      by_name[imported.chain.joints[static_cast<std::size_t>(i)].name] = q[i];
    }
    const Eigen::Isometry3d expected =
        UrdfTip(xml, imported.chain.base, imported.chain.tip, by_name);
    kinematics::Posture posture;
    table.Evaluate(q, posture);
    const Pose X = imported.cell.robot.X_WB * posture.X_BF();
    farthest_m = std::max(farthest_m, (X.p - expected.translation()).norm());
    largest_rad =
        std::max(largest_rad, Eigen::AngleAxisd(X.R.transpose() * expected.linear()).angle());
  }
  CHECK(farthest_m < 1e-9);
  CHECK(largest_rad < 1.7e-8);
}

}  // namespace plumbline::test
