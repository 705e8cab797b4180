#include <cmath>
#include <numbers>
#include <stdexcept>

#include "tests/simulator/cell.h"

namespace simulator {
namespace {

struct ReadyRow {
  double a_mm, alpha_deg, d_mm, offset_deg, sign, min_deg, max_deg, mass_kg;
  Eigen::Vector3d com_mm;
  double compliance;
};

void AddJoints(Cell& cell, const std::vector<ReadyRow>& rows) {
  for (const ReadyRow& row : rows) {
    Joint joint;
    joint.a_m = row.a_mm * 1e-3;
    joint.alpha_rad = row.alpha_deg * kDeg;
    joint.d_m = row.d_mm * 1e-3;
    joint.offset_rad = row.offset_deg * kDeg;
    joint.sign = row.sign;
    joint.min_rad = row.min_deg * kDeg;
    joint.max_rad = row.max_deg * kDeg;
    joint.mass_kg = row.mass_kg;
    joint.mass_known = true;
    joint.com_m = row.com_mm * 1e-3;
    joint.compliance_rad_per_Nm = row.compliance;
    cell.joints.push_back(joint);
  }
}

Tool Tube(double length_m, double side_m, double wall_m, double mount_kg) {
  Tool tool;
  tool.length_m = length_m;
  tool.side_m = side_m;
  tool.wall_m = wall_m;
  tool.youngs_modulus_Pa = 70e9;
  tool.poisson_ratio = 0.33;
  tool.density_kg_m3 = 2700.0;
  tool.mount_mass_kg = mount_kg;
  return tool;
}

/// KR 210 R2700 extra: kinematics from ros-industrial/kuka_experimental; masses, centres
/// and compliances are fictitious, with realistic proportions.
Cell Kr210() {
  Cell cell;
  AddJoints(cell, {{350, -90, 675, 0, -1, -150, 150, 270, {-180, 90, 10}, 3.0e-7},
                   {1150, 0, 0, 0, 1, -115, -25, 175, {-580, 0, 140}, 4.0e-7},
                   {-41, 90, 0, -90, 1, 35, 130, 125, {15, 45, 25}, 6.0e-7},
                   {0, -90, -1200, 0, 1, -160, 160, 55, {0, -260, 0}, 1.7e-6},
                   {0, 90, 0, 0, 1, -105, 105, 38, {0, 0, 25}, 2.0e-6},
                   {0, 180, -215, 180, 1, -170, 170, 14, {0, 0, -25}, 3.5e-6}});
  cell.tool = Tube(1.1, 0.08, 0.005, 9.0);
  cell.payload_cog_m = Eigen::Vector3d(0.02, 0.05, 1.18);
  cell.payloads_kg = {0, 20, 40, 60, 80};
  return cell;
}

/// UR10: kinematics and masses as published by the manufacturer; compliances fictitious.
Cell Ur10() {
  Cell cell;
  AddJoints(cell, {{0, 90, 127.3, 0, 1, -170, 170, 7.1, {21, 0, 27}, 8e-6},
                   {-612, 0, 0, 0, 1, -150, -30, 12.7, {380, 0, 158}, 8e-6},
                   {-572.3, 0, 0, 0, 1, -130, 130, 4.27, {240, 0, 68}, 1.5e-5},
                   {0, 90, 163.941, 0, 1, -170, 170, 2.0, {0, 7, 18}, 4e-5},
                   {0, -90, 115.7, 0, 1, -150, 150, 2.0, {0, 7, 18}, 4e-5},
                   {0, 0, 92.2, 0, 1, -170, 170, 0.365, {0, 0, -26}, 4e-5}});
  cell.tool = Tube(0.5, 0.03, 0.002, 0.5);
  cell.payload_cog_m = Eigen::Vector3d(0.01, 0.02, 0.53);
  cell.payloads_kg = {0, 1.5, 3, 4.5, 6};
  return cell;
}

/// A fictitious arm of 1.6 m reach in the proximal convention, without collinear axes.
Cell Arm6() {
  Cell cell;
  cell.proximal = true;
  AddJoints(cell, {{0, 0, 450, 0, 1, -160, 160, 90, {40, -30, -80}, 6e-7},
                   {180, -90, 0, 0, 1, -120, -20, 60, {330, 10, 60}, 9e-7},
                   {700, 0, 0, 0, -1, -60, 80, 40, {30, 80, 20}, 1.2e-6},
                   {120, -90, 720, 0, 1, -170, 170, 20, {0, 10, -150}, 4e-6},
                   {0, 90, 0, 0, 1, -110, 110, 9, {0, 0, 20}, 5e-6},
                   {0, -90, 110, 0, -1, -170, 170, 3, {0, 0, -15}, 9e-6}});
  cell.tool = Tube(0.8, 0.05, 0.003, 3.0);
  cell.payload_cog_m = Eigen::Vector3d(-0.02, 0.03, 0.85);
  cell.payloads_kg = {0, 5, 10, 15, 20};
  return cell;
}

/// A fictitious lift with an extending horizontal axis and a wrist of three joints.
Cell Lift() {
  Cell cell;
  AddJoints(cell, {{0, -90, 400, 0, 1, 0, 0, 80, {0, 60, 40}, 0},
                   {0, 90, 300, 0, 1, 0, 0, 35, {0, -20, -250}, 0},
                   {150, -90, 0, 0, 1, -150, 150, 9, {-60, 0, 30}, 4e-6},
                   {0, 90, 0, 0, 1, -100, 100, 6, {0, 20, 0}, 5e-6},
                   {0, 0, 120, 0, 1, -170, 170, 3, {0, 0, -40}, 8e-6}});
  for (std::size_t i = 0; i < 2; ++i) {
    cell.joints[i].prismatic = true;
    cell.joints[i].compliance_rad_per_Nm.reset();
  }
  cell.joints[0].min_rad = 0.0;
  cell.joints[0].max_rad = 0.8;
  cell.joints[1].min_rad = 0.2;
  cell.joints[1].max_rad = 1.3;
  cell.tool = Tube(0.5, 0.05, 0.003, 2.0);
  cell.payload_cog_m = Eigen::Vector3d(0.02, -0.03, 0.55);
  cell.payloads_kg = {0, 5, 10, 15, 20};
  return cell;
}

}  // namespace

std::vector<std::string> ReadyRobots() {
  return {"kr210", "ur10", "arm6", "lift"};
}

Cell ReadyCell(const std::string& robot) {
  Cell cell;
  if (robot == "kr210") {
    cell = Kr210();
  } else if (robot == "ur10") {
    cell = Ur10();
  } else if (robot == "arm6") {
    cell = Arm6();
  } else if (robot == "lift") {
    cell = Lift();
  } else {
    throw std::runtime_error("no robot " + robot + "; there are kr210, ur10, arm6, lift");
  }
  cell.name = robot;
  return cell;
}

Eigen::Vector3d AnchorBeside(const Cell& cell) {
  double reach_m = cell.tool.length_m;
  for (const Joint& joint : cell.joints) reach_m += std::hypot(joint.a_m, joint.d_m);
  return reach_m * Eigen::Vector3d(0.5, -0.9, 0.3);
}

Cell::Camera CameraBeside(const Cell& cell) {
  double reach_m = cell.tool.length_m;
  for (const Joint& joint : cell.joints) reach_m += std::hypot(joint.a_m, joint.d_m);
  constexpr double kDown = 0.2;  // [rad]
  Cell::Camera camera;
  camera.at_m = 2.0 * reach_m * Eigen::Vector3d(0.0, -std::cos(kDown), std::sin(kDown));
  // z looks along +y and down, x to the right, y down.
  camera.rpy_rad = {-std::numbers::pi / 2.0 - kDown, 0.0, 0.0};
  return camera;
}

}  // namespace simulator
