#include "app/base/config/unlikely_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "app/base/config/arm_size.h"
#include "firmware-like/kinematics/chain.h"

namespace plumbline::config {
namespace {

// Smaller non-zero lengths are taken for metres written in place of millimetres.
constexpr double kSmallestArm_m = 0.01;  // the longest of all a and d
constexpr double kSmallestPoint_m = 0.01;
constexpr double kSmallestOffset_m = 0.001;  // of a centre of gravity
constexpr double kSmallestTip_m = 0.01;
constexpr double kFarthestCog_m = 10;
constexpr double kLongTool_m = 0.1;
constexpr double kAtFlange = 0.1;  // share of the tool's length
constexpr double kTurnInRadians = 2 * std::numbers::pi + 1e-3;
constexpr double kGravity_m_s2 = 9.80665, kGravityVaries_m_s2 = 0.05;

/// True if a value in degrees is numerically a multiple of a quarter turn in radians, as people
/// round it: 1.5708, 3.14.
bool LooksLikeRadians(double angle_deg) {
  const double quarters = std::abs(angle_deg) / (std::numbers::pi / 2);
  const double nearest = std::round(quarters);
  return nearest >= 1 && nearest <= 4 && std::abs(quarters - nearest) < 0.002;
}

void WarnAboutAngle(const TomlTable& joint, std::string_view key, double angle_rad) {
  const double angle_deg = angle_rad / kRadPerDeg;
  if (!LooksLikeRadians(angle_deg)) return;
  const double meant_deg = 90 * std::round(angle_deg / (std::numbers::pi / 2));
  joint.AddWarning(key, fmt::format("looks like radians; in degrees write {:g}", meant_deg));
}

/// Warns if both limits of a revolute joint are so close together that they are probably radians.
void WarnAboutLimits(const TomlTable& table, const model::Joint& joint) {
  constexpr double kSmallestRange_deg = 1.5;  // 1.5 rad = 86 deg; a blocked axis has less
  if (joint.type == model::JointType::kPrismatic || !table.Has("min_deg") || !table.Has("max_deg"))
    return;
  const double min_deg = joint.min / kRadPerDeg, max_deg = joint.max / kRadPerDeg;
  const bool small = std::max(std::abs(min_deg), std::abs(max_deg)) <= kTurnInRadians;
  if (!small || max_deg - min_deg < kSmallestRange_deg) return;
  table.AddWarning(
      "max_deg",
      fmt::format("with min_deg {:g} leaves this axis {:.2g} degrees; the limits look like "
                  "radians: write min_deg = {:.4g}, max_deg = {:.4g}",
                  min_deg, max_deg - min_deg, min_deg / kRadPerDeg, max_deg / kRadPerDeg));
}

void WarnAboutGravity(const TomlTable& table, const model::Robot& robot) {
  if (!table.Has("gravity_m_s2") || robot.g_W.norm() == 0) return;
  if (robot.g_W.z() > 0.5 * robot.g_W.norm()) {
    table.AddWarning("gravity_m_s2",
                     "points up; correct only if z of the measurement frame points down, otherwise "
                     "write [0, 0, -9.80665]");
  }
  if (std::abs(robot.g_W.norm() - kGravity_m_s2) > kGravityVaries_m_s2) {
    table.AddWarning(
        "gravity_m_s2",
        fmt::format("has magnitude {:.4g} m/s2; on earth it is 9.78 to 9.83", robot.g_W.norm()));
  }
}

/// True if the vector was probably written in metres instead of millimetres.
bool LooksLikeMetres(const Vec3& p, double smallest_m) {
  return p.norm() > 0 && p.norm() < smallest_m;
}

std::string FarCogText(double distance_m) {
  return fmt::format("is {:.3g} m from the flange; write mm, measured from the flange", distance_m);
}

/// Warns about a payload item whose centre of gravity is metres away.
void WarnAboutItems(const TomlTable& payload, const model::CellModel& cell) {
  const std::vector<TomlTable> items = payload.Tables("item");
  for (std::size_t k = 0; k < std::min(items.size(), cell.payload_items.size()); ++k) {
    const double distance_m = cell.payload_items[k].cog_F.norm();
    if (distance_m > kFarthestCog_m) items[k].AddWarning("cog_mm", FarCogText(distance_m));
  }
}

/// Distance of a point from the robot's base, and the lengths that can bridge it.
struct Distances {
  double point_m, arm_m, tool_m;
};
Distances DistancesOf(const model::CellModel& cell, const correction::AssemblyPoint& point) {
  return {(point.X_WP.p - cell.robot.X_WB.p).norm(), kinematics::Chain(cell.robot).Reach(),
          cell.tool.tcp_F.norm() + point.p_TP.norm()};
}

}  // namespace

bool LookLikeRadians(const std::vector<double>& angles_deg) {
  const bool small = std::all_of(angles_deg.begin(), angles_deg.end(), [](double angle_deg) {
    return std::abs(angle_deg) <= kTurnInRadians;
  });
  return small && std::any_of(angles_deg.begin(), angles_deg.end(), LooksLikeRadians);
}

void WarnAboutRadians(const TomlTable& table, std::string_view key) {
  if (!table.Has(key)) return;
  const auto angles = table.Numbers(key, {-100000, 100000});
  if (!angles || !LookLikeRadians(*angles)) return;
  std::string degrees;
  for (const double angle : *angles) {
    const double quarters = angle / (std::numbers::pi / 2);
    degrees += fmt::format("{}{:.5g}", degrees.empty() ? "" : ", ",
                           LooksLikeRadians(angle) ? 90 * std::round(quarters) : 90 * quarters);
  }
  table.AddWarning(key, fmt::format("looks like radians; in degrees write [{}]", degrees));
}

bool IsPointInMetres(const Vec3& p_OP) {
  return LooksLikeMetres(p_OP, kSmallestPoint_m);
}

bool IsFarAway(const model::CellModel& cell, const correction::AssemblyPoint& point) {
  const Distances d = DistancesOf(cell, point);
  return d.point_m > d.arm_m + d.tool_m;
}

void WarnAboutUnlikelyRobot(const TomlTable& table, const std::vector<TomlTable>& joints,
                            const model::Robot& robot) {
  WarnAboutGravity(table, robot);
  double longest_m = 0;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const model::Joint& joint = robot.joints[i];
    longest_m = std::max({longest_m, std::abs(joint.a_m), std::abs(joint.d_m)});
    WarnAboutAngle(joints[i], "alpha_deg", joint.alpha_rad);
    WarnAboutAngle(joints[i], "theta_offset_deg", joint.theta_offset_rad);
    WarnAboutAngle(joints[i], "gamma_deg", joint.gamma_rad);
    WarnAboutLimits(joints[i], joint);
  }
  WarnAboutRadians(table, "base_rpy_deg");
  if (longest_m == 0) return;
  if (longest_m >= kSmallestArm_m) return WarnAboutUnlikelyParts(joints, robot);
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const model::Joint& joint = robot.joints[i];
    const bool a_is_longer = std::abs(joint.a_m) > std::abs(joint.d_m);
    if (std::max(std::abs(joint.a_m), std::abs(joint.d_m)) < longest_m) continue;
    joints[i].AddWarning(a_is_longer ? "a_mm" : "d_mm",
                         "is the longest length of the arm and looks like metres; write mm");
    return;
  }
}

void WarnAboutUnlikelyLoad(const TomlTable& root, const model::CellModel& cell) {
  WarnAboutLongTool(root, cell);
  const std::vector<TomlTable> tools = root.TableOrTables("tool");
  const auto payload = root.Table("payload");
  for (int k = 0; k < std::min(static_cast<int>(tools.size()), cell.tools()); ++k) {
    const model::Tool& tool = cell.ToolAt(k);
    if (!LooksLikeMetres(tool.tcp_F, kSmallestTip_m)) continue;
    tools[static_cast<std::size_t>(k)].AddWarning(tool.rigid ? "tcp_mm" : "length_mm",
                                                  "looks like metres; write mm");
  }
  if (payload) WarnAboutItems(*payload, cell);
  if (!payload || !cell.payload_cog_F) return;
  const Vec3& cog_F = *cell.payload_cog_F;
  const double tip_m = cell.tool.tcp_F.norm();
  if (cog_F.norm() > kFarthestCog_m) {
    payload->AddWarning("cog_mm", FarCogText(cog_F.norm()));
  } else if (LooksLikeMetres(cog_F, kSmallestOffset_m)) {
    payload->AddWarning("cog_mm", "looks like metres; write mm");
  } else if (tip_m > kLongTool_m && cog_F.norm() < kAtFlange * tip_m) {
    const Vec3 tip_mm = cell.tool.tcp_F / kMetrePerMm;
    payload->AddWarning(
        "cog_mm", fmt::format("is at the flange, but the tool's tip is {:.4g} mm away; if the "
                              "payload is at the tip, write about [{:.6g}, {:.6g}, {:.6g}]",
                              tip_m / kMetrePerMm, tip_mm.x(), tip_mm.y(), tip_mm.z()));
  }
}

void WarnAboutUnlikelyPoint(const TomlTable& table, const Vec3& p_OP,
                            const correction::AssemblyPoint& point, const model::CellModel& cell) {
  if (!table.Has("xyz_mm")) return;  // already reported as a fault
  if (IsPointInMetres(p_OP)) {
    table.AddWarning("xyz_mm", "looks like metres; write mm");
    return;
  }
  if (!IsFarAway(cell, point)) return;
  const auto [point_m, arm_m, tool_m] = DistancesOf(cell, point);
  table.AddWarning("xyz_mm",
                   fmt::format("is {:.4g} m from the robot's base, out of reach of an arm of "
                               "{:.4g} m with a tool of {:.4g} m; check the point, its frame and "
                               "the cell's base_xyz_mm",
                               point_m, arm_m, tool_m));
}

}  // namespace plumbline::config
