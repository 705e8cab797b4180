#include "app/vision/hand_eye/robot_poses.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "app/base/config/wrong_file.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline::vision {
namespace {

constexpr double kQuaternionTolerance = 0.01;  // deviation of its norm from 1
constexpr double kLargestNumber = 1e6;

std::string_view Trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r\"");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r\"") - first + 1);
}

std::vector<std::string_view> Fields(std::string_view line) {
  std::vector<std::string_view> fields;
  while (true) {
    const auto comma = line.find(',');
    fields.push_back(Trimmed(line.substr(0, comma)));
    if (comma == std::string_view::npos) return fields;
    line.remove_prefix(comma + 1);
  }
}

std::optional<double> NumberOf(std::string_view field) {
  double number = 0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), number);
  if (error != std::errc() || end != field.data() + field.size()) return std::nullopt;
  if (!std::isfinite(number)) return std::nullopt;
  return number;
}

/// Index of a column by name; -1 if there is none.
int ColumnOf(const std::vector<std::string_view>& header, std::string_view name) {
  const auto found = std::ranges::find(header, name);
  return found == header.end() ? -1 : static_cast<int>(found - header.begin());
}

}  // namespace

std::optional<std::map<std::string, RobotPose>> RobotPosesFromCsv(
    std::string_view text, const std::string& file, const std::vector<model::Joint>& joints,
    config::FaultList& faults) {
  if (config::RefuseWrongFile(text, file, config::kWantedPoses, faults)) return std::nullopt;
  const auto fault = [&](int line, const std::string& what) {
    faults.Add({config::Fault::Severity::kFault, file, line, "", what});
  };
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  std::map<std::string, RobotPose> poses;
  std::vector<std::string_view> header;
  std::vector<int> columns;
  std::vector<std::string> names;
  bool by_joints = false, good = true;
  bool too_far = false;  // reported once: it is the unit of all rows
  int image = -1;
  for (int line = 1; !text.empty(); ++line) {
    const auto end = text.find('\n');
    const std::vector<std::string_view> fields = Fields(text.substr(0, end));
    text = end == std::string_view::npos ? std::string_view() : text.substr(end + 1);
    if (fields.size() == 1 && fields[0].empty()) continue;
    if (header.empty()) {
      header = fields;
      image = ColumnOf(header, "image");
      by_joints = std::ranges::any_of(header, [](std::string_view name) {
        const auto column = model::JointColumnFromName(name);
        return column && column->joint == 0 &&
               column->form->quantity == model::JointQuantity::kPosition;
      });
      if (by_joints && joints.empty()) {
        fault(line, "contains joints: give the cell as well (--cell), or use flange poses");
        return std::nullopt;
      }
      names = {"x_mm", "y_mm", "z_mm", "qw", "qx", "qy", "qz"};
      if (by_joints) names.clear();
      for (std::size_t i = 0; by_joints && i < joints.size(); ++i) {
        names.push_back(model::JointColumnName(model::JointQuantity::kPosition, joints[i].type,
                                               static_cast<int>(i)));
      }
      for (const std::string& name : names) columns.push_back(ColumnOf(header, name));
      names.insert(names.begin(), "image");
      columns.insert(columns.begin(), image);
      for (std::size_t k = 0; k < columns.size(); ++k) {
        if (columns[k] >= 0) continue;
        fault(line, fmt::format("has no column {}", names[k]));
        good = false;
      }
      if (!good) return std::nullopt;
      continue;
    }
    std::vector<double> values;
    for (std::size_t k = 1; k < columns.size(); ++k) {
      const auto at = static_cast<std::size_t>(columns[k]);
      const auto number = at < fields.size() ? NumberOf(fields[at]) : std::nullopt;
      if (!number) {
        fault(line, fmt::format("{} is missing or not a number", names[k]));
        good = false;
        break;
      }
      if (std::abs(*number) > kLargestNumber) {
        if (!too_far)
          fault(line,
                fmt::format("{} is {:g}: no robot reaches or turns that far; are the positions "
                            "in micrometres?",
                            names[k], *number));
        too_far = true;
        good = false;
        break;
      }
      values.push_back(*number);
    }
    if (values.size() + 1 != columns.size()) continue;
    const auto at = static_cast<std::size_t>(image);
    const std::string name(at < fields.size() ? fields[at] : std::string_view());
    RobotPose pose;
    if (by_joints) {
      pose.q.resize(static_cast<Eigen::Index>(values.size()));
      for (std::size_t i = 0; i < values.size(); ++i) {
        pose.q[static_cast<Eigen::Index>(i)] =
            values[i] * model::PositionForm(joints[i].type).to_SI;
      }
    } else {
      const Eigen::Quaterniond turn(values[3], values[4], values[5], values[6]);
      if (std::abs(turn.norm() - 1) > kQuaternionTolerance) {
        fault(line, "qw, qx, qy, qz are not a unit quaternion");
        good = false;
        continue;
      }
      pose.X_BF.R = turn.normalized().toRotationMatrix();
      pose.X_BF.p = kMetrePerMm * Vec3(values[0], values[1], values[2]);
    }
    if (name.empty() || !poses.emplace(name, pose).second) {
      fault(line, name.empty() ? "names no image" : fmt::format("{} is listed twice", name));
      good = false;
    }
  }
  if (header.empty()) {
    fault(1, "is empty; expected a header and a row for each image");
    return std::nullopt;
  }
  return good ? std::optional(poses) : std::nullopt;
}

}  // namespace plumbline::vision
