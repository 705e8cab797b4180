#include "app/cli/controller_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "app/base/config/cell_reader.h"
#include "app/measure/controller/relation_text.h"
#include "app/measure/diagnosis/output/model_writer.h"
#include "app/measure/table/csv.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/loads/numbered_load.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline::cli {
namespace {

/// Three columns of an orientation, and the convention that their names state.
struct AngleColumns {
  std::array<const char*, 3> names;
  int in_rad, in_deg;  ///< convention by the unit of the names
};
constexpr std::array kAngleColumns = {
    AngleColumns{{"rx", "ry", "rz"}, measure::kRotationVectorAngles, measure::kRollPitchYawAngles},
    AngleColumns{
        {"roll", "pitch", "yaw"}, measure::kRollPitchYawAngles, measure::kRollPitchYawAngles},
    AngleColumns{{"a", "b", "c"}, measure::kAbcAngles, measure::kAbcAngles},
    AngleColumns{{"w", "p", "r"}, measure::kRollPitchYawAngles, measure::kRollPitchYawAngles},
    AngleColumns{{"o", "a", "t"}, measure::kZyzAngles, measure::kZyzAngles},
};
struct AngleUnit {
  const char* suffix;
  double to_rad;
};
constexpr std::array kAngleUnits = {AngleUnit{"_deg", kRadPerDeg}, AngleUnit{"_rad", 1.0},
                                    AngleUnit{"_mrad", 1e-3}};

/// Where a table has its three angles.
struct FoundAngles {
  std::array<std::size_t, 3> columns{};
  double to_rad = 1;
  int convention = 0;
};

std::optional<FoundAngles> AnglesOf(const measure::MeasuredTable& table) {
  for (const AngleColumns& columns : kAngleColumns) {
    for (const AngleUnit& unit : kAngleUnits) {
      FoundAngles found{
          {}, unit.to_rad, unit.to_rad == kRadPerDeg ? columns.in_deg : columns.in_rad};
      std::size_t count = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::string name = std::string(columns.names[k]) + unit.suffix;
        const auto at = std::find(table.further.begin(), table.further.end(), name);
        if (at == table.further.end()) break;
        found.columns[k] = static_cast<std::size_t>(at - table.further.begin());
        ++count;
      }
      if (count == 3) return found;
    }
  }
  return std::nullopt;
}

std::optional<int> ConventionNamed(const std::string& name) {
  const auto& all = measure::AngleConventions();
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (name == all[k].name) return static_cast<int>(k);
  }
  return std::nullopt;
}

std::optional<loads::Payload> PayloadOf(const measure::MeasuredRow& row,
                                        const model::CellModel& cell) {
  if (!row.payload_kg || !cell.payload_cog_F) return std::nullopt;
  loads::Payload payload;
  payload.mass_kg = *row.payload_kg;
  payload.cog_F = *cell.payload_cog_F;
  return payload;
}

}  // namespace

std::optional<measure::ControllerSample> ReadControllerSample(const std::string& path,
                                                              const model::CellModel& cell,
                                                              const std::string& convention,
                                                              config::FaultList& faults) {
  config::FaultList read;
  const auto table = measure::ReadTable(path, cell.robot.joints, read);
  for (const config::Fault& fault : read.All()) {
    // A column of angles is no part of measured.csv.
    if (fault.severity == config::Fault::Severity::kFault || fault.line > 1) faults.Add(fault);
  }
  if (!table) return std::nullopt;
  const auto fault = [&](const std::string& what) {
    faults.Add({.file = path, .key = "", .what = what});
    return std::nullopt;
  };
  if (!table->recorded.position)
    return fault("has no reported position: x_mm, y_mm, z_mm, beside q1_deg, q2_deg, ..");
  measure::ControllerSample sample;
  const auto angles = AnglesOf(*table);
  sample.with_orientation = angles || table->recorded.orientation;
  sample.convention = angles ? angles->convention : -1;
  if (angles && !convention.empty()) {
    const auto named = ConventionNamed(convention);
    if (!named) return fault(fmt::format("--orientation {} is unknown", convention));
    sample.convention = *named;
  }
  sample.joint_step = 0;
  for (const measure::MeasuredRow& row : table->rows) {
    if (!row.measured_W) continue;
    // Without a number, the tool is the first: --tool states another one.
    const auto tool = row.tool_number ? loads::ToolIndexOf(cell, row.tool_number) : 0;
    if (!tool) {
      faults.Add({.severity = config::Fault::Severity::kWarning,
                  .file = path,
                  .line = row.line,
                  .key = "tool",
                  .what = "is no tool of the cell: the row is not used"});
      continue;
    }
    sample.joint_step = std::max(sample.joint_step, row.q_step_rad.value_or(0));
    measure::ControllerPosture& posture = sample.postures.emplace_back();
    posture.line = row.line;
    posture.q = row.q;
    posture.tool = *tool;
    posture.qd = row.qd;
    posture.p = *row.measured_W;
    posture.temp_C = row.temp_C;
    posture.t_s = row.t_s;
    posture.payload = PayloadOf(row, cell);
    posture.R = Mat3::Identity();
    posture.angles = Vec3::Zero();
    if (angles) {
      for (int k = 0; k < 3; ++k) {
        posture.angles[k] =
            angles->to_rad * row.further[angles->columns[static_cast<std::size_t>(k)]];
      }
      posture.R = measure::RotationFromNumbers(
          posture.angles, measure::AngleConventions()[static_cast<std::size_t>(sample.convention)]);
    } else if (row.orientation_W) {
      posture.R = row.orientation_W->toRotationMatrix();
      posture.angles = VectorFromRotation(posture.R);
    }
    if (!posture.angles.allFinite()) sample.postures.pop_back();
  }
  if (!angles && sample.with_orientation) {
    // A parser normalises quaternions, which hides their step; six decimals are usual.
    sample.angle_step = 2e-6;
  }
  return sample;
}

std::string ControllerSampleCsv(const measure::ControllerSample& sample,
                                const model::Robot& robot) {
  std::string text;
  for (int i = 0; i < robot.size(); ++i) {
    text += model::JointColumnName(model::JointQuantity::kPosition,
                                   robot.joints[static_cast<std::size_t>(i)].type, i) +
            ",";
  }
  text += "x_mm,y_mm,z_mm,qw,qx,qy,qz,payload_kg\n";
  for (const measure::ControllerPosture& posture : sample.postures) {
    for (int i = 0; i < robot.size(); ++i) {
      const auto type = robot.joints[static_cast<std::size_t>(i)].type;
      text += fmt::format("{:.9f},", posture.q[i] / model::PositionForm(type).to_SI);
    }
    const Eigen::Quaterniond q(posture.R);
    text += fmt::format("{:.6f},{:.6f},{:.6f},{:.9f},{:.9f},{:.9f},{:.9f},{}\n",
                        kMmPerMetre * posture.p.x(), kMmPerMetre * posture.p.y(),
                        kMmPerMetre * posture.p.z(), q.w(), q.x(), q.y(), q.z(),
                        posture.payload ? fmt::format("{:.4f}", posture.payload->mass_kg) : "");
  }
  return text;
}

namespace {

std::string NewRobotKeys(const model::CellModel& cell) {
  std::string text = "joint = [\n";
  for (const std::string& row : measure::JointRows(cell.robot)) text += "  " + row + ",\n";
  text += "]\n";
  if (!cell.robot.couplings.empty())
    text += fmt::format("coupling = {}\n", measure::CouplingText(cell.robot));
  return text;
}

/// "robot.joint" of "[[robot.joint]]".
std::string HeaderName(std::string_view text) {
  const auto first = text.find_first_not_of(" \t[");
  return std::string(text.substr(first, text.find_first_of("] \t", first) - first));
}

}  // namespace

Result<std::string> ChangedCellText(std::string_view text, const model::CellModel& before,
                                    const model::CellModel& changed) {
  using Kind = measure::TomlStatement::Kind;
  const auto replaced = [](const std::string& key) { return key == "joint" || key == "coupling"; };
  std::string result, header;
  bool written = false;
  const auto finish_robot = [&] {
    if (header != "robot" || written) return;
    // Blank lines and comments before the next table stay before it.
    const auto end = result.find_last_not_of(" \t\r\n");
    result.insert(end + 1, "\n" + NewRobotKeys(changed) + "\n");
    written = true;
  };
  for (const measure::TomlStatement& statement : measure::TomlStatements(text)) {
    if (statement.kind == Kind::kHeader) {
      finish_robot();
      header = HeaderName(statement.text);
    }
    if (header == "robot.joint" || header == "robot.coupling") continue;
    if (statement.kind == Kind::kKeyValue) {
      if (header == "robot" && replaced(statement.first_key)) continue;
      if (header == "tool" && statement.first_key == "tcp_mm" &&
          before.tool.tcp_F != changed.tool.tcp_F) {
        const Vec3 p = kMmPerMetre * changed.tool.tcp_F;
        result += fmt::format("tcp_mm = [{:.6f}, {:.6f}, {:.6f}]\n", p.x(), p.y(), p.z());
        continue;
      }
    }
    result += statement.text;
  }
  finish_robot();
  if (!written) return Error{"the cell has no table [robot] of its own: write the lines by hand"};
  config::FaultList faults;
  if (!config::CellFromText(result, "the changed cell", faults))
    return Error{"the changed cell would have faults: " + config::FaultsText(faults)};
  return result;
}

}  // namespace plumbline::cli
