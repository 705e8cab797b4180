#include "app/base/config/point_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string>

#include "app/base/config/daemon_settings.h"
#include "app/base/config/unlikely_values.h"
#include "drivers/plc/register_map.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline::config {
namespace {

using FrameTable = std::map<std::string, Pose>;

Pose PoseOf(const FrameKeys& placed) {
  return {.R = RotationFromRollPitchYaw(placed.rpy_rad), .p = placed.xyz_m};
}

FrameTable FramesFromToml(const TomlTable& root, const model::CellModel* cell) {
  FrameTable frames;
  frames["measurement"] = Pose();
  frames["base"] = cell != nullptr ? cell->robot.X_WB : Pose();
  for (const TomlTable& table : root.Tables("frame")) {
    FrameKeys frame;
    ReadKeys(table, frame);
    if (!frame.name.empty() && !frames.emplace(frame.name, PoseOf(frame)).second) {
      table.AddFault("name", "is used for two frames (\"measurement\" and \"base\" are built in)");
    }
  }
  return frames;
}

/// Joint values of `near_deg` in SI, checked against the joints if the cell is known.
std::optional<model::JointVector> NearFromToml(const TomlTable& table,
                                               const std::optional<std::vector<double>>& values,
                                               const model::CellModel* cell) {
  if (!values || cell == nullptr) return std::nullopt;
  const int n = cell->robot.size();
  if (static_cast<int>(values->size()) != n) {
    table.AddFault("near_deg",
                   fmt::format("has {} values; the cell has {} joints", values->size(), n));
    return std::nullopt;
  }
  model::JointVector q(n);
  bool outside = false;
  for (int i = 0; i < n; ++i) {
    const model::Joint& joint = cell->robot.joints[static_cast<std::size_t>(i)];
    const double to_si = model::PositionForm(joint.type).to_SI;
    q[i] = (*values)[static_cast<std::size_t>(i)] * to_si;
    if (q[i] < joint.min || q[i] > joint.max) {
      table.AddFault("near_deg", fmt::format("has joint {} outside its limits {:g}..{:g}", i + 1,
                                             joint.min / to_si, joint.max / to_si));
      outside = true;
    }
  }
  if (outside) WarnAboutRadians(table, "near_deg");
  return q;
}

correction::AssemblyPoint PointFromToml(const TomlTable& table, const FrameTable& frames,
                                        const model::CellModel* cell) {
  PointKeys placed;
  ReadKeys(table, placed);
  correction::AssemblyPoint& point = placed.point;
  point.name = placed.name.empty() ? fmt::format("point {}", point.id) : placed.name;
  const auto found = frames.find(placed.frame);
  if (found == frames.end()) {
    std::string names;
    for (const auto& [name, pose] : frames) names += (names.empty() ? "" : ", ") + name;
    table.AddFault("frame", "is not a declared frame; declared are " + names);
  }
  const Pose X_OP = PoseOf(placed);
  point.X_WP = found == frames.end() ? X_OP : found->second * X_OP;
  point.near_q = NearFromToml(table, placed.near, cell);
  if (!table.Has("near_deg")) {
    table.AddWarning("near_deg",
                     "missing; the arm configuration will depend on where the robot is when the "
                     "daemon starts. Give the joint values at which the point was taught");
  }
  if (point.payload_kg.value_or(0) > 0 && cell != nullptr && !cell->payload_cog_F) {
    table.AddWarning("payload_kg", "cannot be used: the cell has no [payload] cog_mm");
  }
  if (cell != nullptr && found != frames.end()) WarnAboutUnlikelyPoint(table, X_OP.p, point, *cell);
  return point;
}

}  // namespace

std::vector<correction::AssemblyPoint> PointsFromToml(const TomlTable& root,
                                                      const model::CellModel* cell) {
  const FrameTable frames = FramesFromToml(root, cell);
  std::vector<correction::AssemblyPoint> points;
  const std::vector<TomlTable> tables = root.Tables("point");
  if (static_cast<int>(tables.size()) > plc::registers::kMaxPoints) {
    root.AddFault("point", fmt::format("is given {} times; at most {} points", tables.size(),
                                       plc::registers::kMaxPoints));
  }
  for (const TomlTable& table : tables) {
    correction::AssemblyPoint point = PointFromToml(table, frames, cell);
    const bool known = std::any_of(points.begin(), points.end(),
                                   [&](const auto& other) { return other.id == point.id; });
    if (known && point.id != 0) table.AddFault("id", "is used for two points");
    points.push_back(std::move(point));
  }
  if (tables.empty()) root.AddWarning("point", "missing; no assembly point will be corrected");
  return points;
}

}  // namespace plumbline::config
