#include "app/cli/point_table.h"

#include <fmt/format.h>

#include <iterator>
#include <sstream>

#include "app/base/text/text.h"
#include "app/cli/rounded.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline::cli {
namespace {

constexpr std::size_t kTableWidth = 80;
constexpr const char* kIndent = "      ";

/// A joint's value in the unit of the files: deg, or mm for a prismatic joint.
double InFileUnit(const model::Robot& robot, int joint, double value) {
  return value / model::PositionForm(robot.joints[static_cast<std::size_t>(joint)].type).to_SI;
}

std::string_view FileUnitOf(const model::Robot& robot, int joint) {
  return model::PositionForm(robot.joints[static_cast<std::size_t>(joint)].type).unit;
}

/// The words wrapped to lines of at most kTableWidth columns, indented.
std::string WrappedLines(const std::vector<std::string>& words) {
  std::string text, line = kIndent;
  bool empty = true;
  for (const std::string& word : words) {
    if (!empty && line.size() + 1 + word.size() > kTableWidth) {
      text += line + "\n";
      line = kIndent;
      empty = true;
    }
    line += (empty ? "" : " ") + word;
    empty = false;
  }
  return text + line + "\n";
}

std::vector<std::string> WordsOf(const std::string& text) {
  std::istringstream words(text);
  return {std::istream_iterator<std::string>(words), {}};
}

std::string PostureLines(const MachineConfig& config, const config::PointSolution& solution) {
  const model::Robot& robot = config.cell.robot;
  const correction::Correction& correction = solution.correction;
  const bool taught = solution.posture.taught;
  std::vector<std::string> words = {taught ? "posture"
                                           : "posture, one of several possible (no near_deg):"};
  for (int i = 0; i < correction.q.size(); ++i) {
    words.push_back(
        fmt::format("{:.1f}", WithoutNegativeZero(InFileUnit(robot, i, correction.q[i]), 1)));
  }
  if (solution.posture.differs) words.push_back("NOT near near_deg");
  const correction::JointDistance& limit = solution.posture.limit;
  const std::string margin = limit.joint < 0
                                 ? "no joint limits"
                                 : fmt::format("{:.1f} {} to the limit of q{}",
                                               InFileUnit(robot, limit.joint, limit.distance),
                                               FileUnitOf(robot, limit.joint), limit.joint + 1);
  return WrappedLines(words) +
         WrappedLines({fmt::format("{}; smallest singular value {:.3f} (limit {:g})", margin,
                                   correction.singular_value, config.limits.min_singular_value)});
}

}  // namespace

std::string PointTable(const MachineConfig& config,
                       const std::vector<config::PointSolution>& solutions) {
  if (solutions.empty()) return "";
  std::string text = fmt::format("\n{:>5} {:<20} {:<16} {:>10} {:>9} {}\n", "point", "name",
                                 "payload", "correction", "95 %", "basis");
  for (const config::PointSolution& solution : solutions) {
    const correction::AssemblyPoint& point = config.points[solution.point];
    const correction::Correction& correction = solution.correction;
    text += fmt::format("{:>5} {:<20.20} {:<16.16} ", point.id, point.name, solution.load.name);
    if (correction.code == correction::CorrectionCode::kOk) {
      const double radius_mm = correction.uncertainty_m / kMetrePerMm;
      const int decimals = text::DecimalsFor({radius_mm}, 0);
      text += fmt::format("{:>7.{}f} mm {:>6.{}f} mm {}\n",
                          correction.translation_B.norm() / kMetrePerMm, decimals, radius_mm,
                          decimals, Describe(correction.basis));
    } else {
      text += fmt::format("NONE: {}\n", Describe(correction.code));
    }
    if (correction.q.size() > 0) text += PostureLines(config, solution);
    if (!solution.orientation_left.empty()) {
      text += WrappedLines(WordsOf(solution.orientation_left));
    }
    if (!solution.out_of_range.empty()) {
      text += WrappedLines(WordsOf("outside the measured range: " + solution.out_of_range));
    }
    if (!solution.beyond_linear.empty()) {
      text += fmt::format("{}WARNING: {}\n", kIndent, solution.beyond_linear);
    }
  }
  if (config.payload.source == PayloadPolicy::Source::kRobot) {
    text +=
        "The payload is known to the robot only (source = \"robot\"); `plumbline status`\n"
        "shows the corrections with the actual payload.\n";
  }
  return text;
}

nlohmann::json PointsJson(const MachineConfig& config,
                          const std::vector<config::PointSolution>& solutions) {
  using Json = nlohmann::json;
  const model::Robot& robot = config.cell.robot;
  Json list = Json::array();
  for (const config::PointSolution& solution : solutions) {
    const correction::AssemblyPoint& point = config.points[solution.point];
    const correction::Correction& correction = solution.correction;
    const bool ok = correction.code == correction::CorrectionCode::kOk;
    Json entry = {{"id", point.id},
                  {"name", point.name},
                  {"payload", solution.load.name},
                  {"payload_kg",
                   solution.load.payload ? Json(solution.load.payload->mass_kg) : Json(nullptr)},
                  {"payload_by_robot", config.payload.source == PayloadPolicy::Source::kRobot &&
                                           !point.payload_kg.has_value()},
                  {"reachable", ok},
                  {"code", static_cast<int>(correction.code)},
                  {"reason", Describe(correction.code)}};
    if (ok) {
      entry["correction_mm"] = correction.translation_B.norm() / kMetrePerMm;
      entry["radius_95_mm"] = correction.uncertainty_m / kMetrePerMm;
      entry["radius_basis"] = Describe(correction.basis);
      if (!solution.orientation_left.empty()) {
        entry["orientation_left_deg"] = correction.residual_rad / kRadPerDeg;
      }
      if (!solution.out_of_range.empty()) entry["out_of_range"] = solution.out_of_range;
      if (!solution.beyond_linear.empty()) entry["beyond_linear"] = solution.beyond_linear;
    }
    if (correction.q.size() > 0) {
      Json joints = Json::array();
      for (int i = 0; i < correction.q.size(); ++i) {
        joints.push_back(InFileUnit(robot, i, correction.q[i]));
      }
      entry["posture"] = {{"joints", joints},
                          {"near_deg_given", solution.posture.taught},
                          {"differs_from_near_deg", solution.posture.differs},
                          {"singular_value", correction.singular_value},
                          {"min_singular_value", config.limits.min_singular_value}};
      if (const correction::JointDistance& limit = solution.posture.limit; limit.joint >= 0) {
        entry["posture"]["limit_joint"] = limit.joint + 1;
        entry["posture"]["limit_distance"] = InFileUnit(robot, limit.joint, limit.distance);
        entry["posture"]["limit_unit"] = FileUnitOf(robot, limit.joint);
      }
    }
    list.push_back(entry);
  }
  return list;
}

}  // namespace plumbline::cli
