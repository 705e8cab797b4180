#include "app/measure/siblings/sibling_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "app/base/config/cell_reader.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::measure {

Result<Arm> ReadArm(const std::string& folder, config::FaultList& faults) {
  namespace fs = std::filesystem;
  Arm arm;
  arm.name = fs::path(folder).lexically_normal().string();
  config::FaultList own;
  const auto cell = config::ReadCell(CellFileOf(folder), own);
  std::optional<MeasuredTable> rows;
  if (cell) {
    arm.cell = *cell;
    rows = ReadTable(RowsFileOf(folder), cell->robot.joints, own);
  }
  if (!cell || !rows) {
    return Error{fmt::format("{}a sibling is a folder with its cell.toml and its measured.csv",
                             config::FaultsText(own))};
  }
  faults.Append(own);
  arm.rows = std::move(*rows);
  return arm;
}

std::string CellFileOf(const std::string& folder) {
  return (std::filesystem::path(folder) / "cell.toml").string();
}

std::string RowsFileOf(const std::string& folder) {
  return (std::filesystem::path(folder) / "measured.csv").string();
}

namespace {

/// C beside D of the couplings; see model::JointCoupling.
Eigen::MatrixXd CouplingMatrix(const model::Robot& robot) {
  const int n = robot.size();
  Eigen::MatrixXd matrix(n, 2 * n);
  for (int joint = 0; joint < n; ++joint) {
    const model::JointVector unit = model::JointVector::Unit(n, joint);
    matrix.col(joint) = model::AxisPositions<double>(robot.couplings, unit);
    matrix.col(n + joint) = model::DrivePositions(robot.couplings, unit);
  }
  return matrix;
}

}  // namespace

std::string DifferenceOf(const model::CellModel& a, const model::CellModel& b) {
  constexpr double kLength_m = 1e-3, kAngle_rad = 0.1 * kRadPerDeg, kShare = 0.01;
  constexpr double kRatio = kAngle_rad;  // over a radian of the other joint
  if (a.robot.size() != b.robot.size()) {
    return fmt::format("it has {} joints, not {}", b.robot.size(), a.robot.size());
  }
  if (a.robot.convention != b.robot.convention) return "its Denavit-Hartenberg convention differs";
  if (!a.effects.empty() || !b.effects.empty()) {
    return fmt::format("{} has effects of its own: give the cell as it was declared",
                       b.effects.empty() ? "the other cell" : "its cell");
  }
  const auto equal = [](const std::optional<double>& one, const std::optional<double>& other) {
    if (!one || !other) return one.has_value() == other.has_value();
    return std::abs(*one - *other) <= kShare * std::max(std::abs(*one), std::abs(*other));
  };
  const Eigen::MatrixXd mixed = CouplingMatrix(a.robot) - CouplingMatrix(b.robot);
  if (mixed.cwiseAbs().maxCoeff() > kRatio) return "its [[robot.coupling]] differ";
  for (int i = 0; i < a.robot.size(); ++i) {
    const model::Joint& one = a.robot.joints[i];
    const model::Joint& other = b.robot.joints[i];
    const bool same = one.type == other.type && one.sign == other.sign &&
                      std::abs(one.a_m - other.a_m) <= kLength_m &&
                      std::abs(one.d_m - other.d_m) <= kLength_m &&
                      std::abs(one.alpha_rad - other.alpha_rad) <= kAngle_rad &&
                      std::abs(one.theta_offset_rad - other.theta_offset_rad) <= kAngle_rad;
    if (!same) return fmt::format("its nominal joint {} differs", i + 1);
    if (!equal(one.compliance_rad_per_Nm, other.compliance_rad_per_Nm)) {
      return fmt::format("the declared compliance of its joint {} differs", i + 1);
    }
    if (!equal(one.link_mass_kg, other.link_mass_kg)) {
      return fmt::format("the declared mass of its link {} differs", i + 1);
    }
  }
  return {};
}

}  // namespace plumbline::measure
