#include <fmt/core.h>
#include <toml++/toml.h>

#include <fstream>
#include <stdexcept>

#include "tests/simulator/cell.h"

namespace simulator {
namespace {

double Number(const toml::table& table, const std::string& key) {
  if (const auto value = table[key].value<double>()) return *value;
  throw std::runtime_error(key + " is missing or no number");
}

double NumberOr(const toml::table& table, const std::string& key, double otherwise) {
  return table[key].value<double>().value_or(otherwise);
}

std::optional<Eigen::Vector3d> Vector(const toml::table& table, const std::string& key) {
  const toml::array* const array = table[key].as_array();
  if (array == nullptr) return std::nullopt;
  if (array->size() != 3) throw std::runtime_error(key + " needs three numbers");
  Eigen::Vector3d vector;
  for (int i = 0; i < 3; ++i) vector[i] = array->get(std::size_t(i))->value<double>().value();
  return vector;
}

Joint ReadJoint(const toml::table& table) {
  Joint joint;
  joint.prismatic = table["type"].value_or(std::string("revolute")) == "prismatic";
  joint.a_m = Number(table, "a_mm") * 1e-3;
  joint.alpha_rad = Number(table, "alpha_deg") * kDeg;
  joint.d_m = Number(table, "d_mm") * 1e-3;
  joint.offset_rad = Number(table, "theta_offset_deg") * kDeg;
  joint.sign = Number(table, "sign");
  joint.min_rad =
      joint.prismatic ? Number(table, "min_mm") * 1e-3 : NumberOr(table, "min_deg", -180.0) * kDeg;
  joint.max_rad =
      joint.prismatic ? Number(table, "max_mm") * 1e-3 : NumberOr(table, "max_deg", 180.0) * kDeg;
  joint.mass_known = table.contains("link_mass_kg");
  joint.mass_kg = NumberOr(table, "link_mass_kg", 0.0);
  joint.com_m = Vector(table, "link_com_mm").value_or(Eigen::Vector3d::Zero()) * 1e-3;
  joint.compliance_rad_per_Nm = table["compliance_rad_per_Nm"].value<double>();
  return joint;
}

Tool ReadTool(const toml::table& table) {
  Tool tool;
  const std::string model = table["model"].value_or(std::string());
  if (model == "rigid") {
    tool.rigid = true;
    tool.tcp_m = Vector(table, "tcp_mm").value_or(Eigen::Vector3d::Zero()) * 1e-3;
    return tool;
  }
  if (model != "euler_bernoulli" || table["section"].value_or(std::string()) != "square_tube") {
    throw std::runtime_error("the simulator knows the Euler-Bernoulli square tube only");
  }
  tool.length_m = Number(table, "length_mm") * 1e-3;
  tool.side_m = Number(table, "side_mm") * 1e-3;
  tool.wall_m = Number(table, "wall_mm") * 1e-3;
  tool.youngs_modulus_Pa = Number(table, "youngs_modulus_GPa") * 1e9;
  tool.poisson_ratio = NumberOr(table, "poisson_ratio", 0.3);
  tool.density_kg_m3 = Number(table, "density_kg_m3");
  tool.mount_mass_kg = NumberOr(table, "mount_mass_kg", 0.0);
  return tool;
}

const toml::table& Section(const toml::table& file, const std::string& name) {
  const toml::table* const table = file[name].as_table();
  if (table == nullptr) throw std::runtime_error("[" + name + "] is missing");
  return *table;
}

std::string Triple(const Eigen::Vector3d& v) {
  return fmt::format("[{:.6g}, {:.6g}, {:.6g}]", v.x(), v.y(), v.z());
}

}  // namespace

double Tool::AreaM2() const {
  const double inner = side_m - 2.0 * wall_m;
  return side_m * side_m - inner * inner;
}

double Tool::SecondMomentM4() const {
  const double inner = side_m - 2.0 * wall_m;
  return (side_m * side_m * side_m * side_m - inner * inner * inner * inner) / 12.0;
}

double Tool::BodyMassKg() const {
  return rigid ? 0.0 : density_kg_m3 * AreaM2() * length_m;
}

Cell ReadCell(const std::string& path) {
  const toml::table file = toml::parse_file(path);
  const toml::table& robot = Section(file, "robot");
  const toml::table& measurement = Section(file, "measurement");
  Cell cell;
  cell.name = robot["name"].value_or(std::string("cell"));
  cell.proximal = robot["convention"].value_or(std::string("dh")) == "mdh";
  cell.gravity_m_s2 = Vector(robot, "gravity_m_s2").value_or(cell.gravity_m_s2);
  cell.base_m = Vector(robot, "base_xyz_mm").value_or(Eigen::Vector3d::Zero()) * 1e-3;
  cell.base_rpy_rad = Vector(robot, "base_rpy_deg").value_or(Eigen::Vector3d::Zero()) * kDeg;
  const toml::array* const joints = robot["joint"].as_array();
  if (joints == nullptr) throw std::runtime_error("[[robot.joint]] is missing");
  for (const toml::node& joint : *joints) cell.joints.push_back(ReadJoint(*joint.as_table()));
  cell.tool = ReadTool(Section(file, "tool"));
  if (const toml::table* const payload = file["payload"].as_table()) {
    cell.payload_cog_m = Vector(*payload, "cog_mm").value_or(Eigen::Vector3d::Zero()) * 1e-3;
  }
  cell.sigma_m = NumberOr(measurement, "sigma_mm", 0.0) * 1e-3;
  cell.reference_temperature_C = NumberOr(measurement, "reference_temperature_C", 22.0);
  if (const auto at = Vector(measurement, "camera_xyz_mm")) {
    cell.camera = Cell::Camera{
        *at * 1e-3, Vector(measurement, "camera_rpy_deg").value_or(Eigen::Vector3d::Zero()) * kDeg};
  }
  if (measurement["kind"].value_or(std::string()) == "range") {
    cell.anchor_m = Vector(measurement, "anchor_mm").value_or(Eigen::Vector3d::Zero()) * 1e-3;
  }
  cell.unaligned = measurement["frame"].value_or(std::string()) == "unaligned";
  cell.tool_unknown = measurement["tool"].value_or(std::string()) == "unknown";
  return cell;
}

void WriteCell(const Cell& cell, const std::string& path) {
  std::string text = fmt::format(
      "schema = {}\n\n[robot]\nname = \"{}\"\nconvention = \"{}\"\ngravity_m_s2 = {}\n"
      "base_xyz_mm = {}\nbase_rpy_deg = {}\n",
      cell.sigma_rad > 0.0 ? 2 : 1, cell.name, cell.proximal ? "mdh" : "dh",
      Triple(cell.gravity_m_s2), Triple(cell.base_m * 1e3), Triple(cell.base_rpy_rad / kDeg));
  for (const Joint& joint : cell.joints) {
    const double unit = joint.prismatic ? 1e-3 : kDeg;
    const char* const name = joint.prismatic ? "mm" : "deg";
    text += fmt::format(
        "\n[[robot.joint]]\na_mm = {:.6g}\nalpha_deg = {:.6g}\nd_mm = {:.6g}\n"
        "theta_offset_deg = {:.6g}\nsign = {}\nmin_{} = {:.6g}\nmax_{} = {:.6g}\n",
        joint.a_m * 1e3, joint.alpha_rad / kDeg, joint.d_m * 1e3, joint.offset_rad / kDeg,
        int(joint.sign), name, joint.min_rad / unit, name, joint.max_rad / unit);
    if (joint.prismatic) text += "type = \"prismatic\"\n";
    if (joint.mass_known) {
      text += fmt::format("link_mass_kg = {:.6g}\nlink_com_mm = {}\n", joint.mass_kg,
                          Triple(joint.com_m * 1e3));
    }
    if (joint.compliance_rad_per_Nm) {
      text += fmt::format("compliance_rad_per_Nm = {:.6e}\n", *joint.compliance_rad_per_Nm);
    }
  }
  const Tool& tool = cell.tool;
  text += fmt::format(
      "\n[tool]\nmodel = \"euler_bernoulli\"\naxis = \"z\"\nlength_mm = {:.6g}\n"
      "section = \"square_tube\"\nside_mm = {:.6g}\nwall_mm = {:.6g}\n"
      "youngs_modulus_GPa = {:.6g}\npoisson_ratio = {:.6g}\ndensity_kg_m3 = {:.6g}\n"
      "mount_mass_kg = {:.6g}\n",
      tool.length_m * 1e3, tool.side_m * 1e3, tool.wall_m * 1e3, tool.youngs_modulus_Pa * 1e-9,
      tool.poisson_ratio, tool.density_kg_m3, tool.mount_mass_kg);
  if (cell.payload_cog_m) {
    text += fmt::format("\n[payload]\ncog_mm = {}\n", Triple(*cell.payload_cog_m * 1e3));
  }
  text += "\n[measurement]\n";
  text += cell.anchor_m
              ? fmt::format("kind = \"range\"\nanchor_mm = {}\n", Triple(*cell.anchor_m * 1e3))
              : "kind = \"position\"\n";
  text += fmt::format("{}{}sigma_mm = {:.6g}\n", cell.unaligned ? "frame = \"unaligned\"\n" : "",
                      cell.tool_unknown ? "tool = \"unknown\"\n" : "", cell.sigma_m * 1e3);
  if (cell.sigma_rad > 0.0) text += fmt::format("sigma_deg = {:.6g}\n", cell.sigma_rad / kDeg);
  text += fmt::format("reference_temperature_C = {:.6g}\n", cell.reference_temperature_C);
  if (cell.camera) {
    text += fmt::format("camera_xyz_mm = {}\ncamera_rpy_deg = {}\n",
                        Triple(cell.camera->at_m * 1e3), Triple(cell.camera->rpy_rad / kDeg));
  }
  std::ofstream(path) << text;
}

}  // namespace simulator
