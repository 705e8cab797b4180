#include "tests/virtual_cell/cell_description.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include "tests/virtual_cell/toml_fields.h"

namespace virtual_cell {
namespace {

/// Area, second moments about x and y, and torsion constant of a section [m^2, m^4].
struct SectionConstants {
  double area, I_x, I_y, J;
};

SectionConstants SquareTube(double side, double wall) {
  const double inner = side - 2 * wall;
  const double I = (std::pow(side, 4) - std::pow(inner, 4)) / 12;
  // Bredt: J = 4 A_m^2 t / perimeter of the wall centre line.
  return {side * side - inner * inner, I, I, std::pow(side - wall, 3) * wall};
}

SectionConstants RoundTube(double outer, double inner) {
  const double I = std::numbers::pi / 64 * (std::pow(outer, 4) - std::pow(inner, 4));
  return {std::numbers::pi / 4 * (outer * outer - inner * inner), I, I, 2 * I};
}

SectionConstants Rectangle(double b, double h) {
  const double longer = std::max(b, h), shorter = std::min(b, h), ratio = shorter / longer;
  const double J = longer * std::pow(shorter, 3) *
                   (1.0 / 3 - 0.21 * ratio * (1 - std::pow(ratio, 4) / 12));  // Roark
  return {b * h, b * h * h * h / 12, h * b * b * b / 12, J};
}

SectionConstants ReadSection(const TomlFields& tool) {
  if (!tool.Has("section")) {
    const double I_x = tool.Number("ix_mm4") * 1e-12, I_y = tool.Number("iy_mm4") * 1e-12;
    return {tool.Number("area_mm2") * 1e-6, I_x, I_y, I_x + I_y};
  }
  const auto mm = [&tool](const char* key) { return tool.Number(key) * 1e-3; };
  const std::string section = tool.Text("section");
  if (section == "square_tube") return SquareTube(mm("side_mm"), mm("wall_mm"));
  if (section == "rectangle") return Rectangle(mm("b_mm"), mm("h_mm"));
  if (section == "rod") return RoundTube(mm("diameter_mm"), 0);
  if (section == "tube") {
    const double outer = mm("outer_diameter_mm");
    return RoundTube(outer, outer - 2 * mm("wall_mm"));
  }
  tool.Fail("section", "the virtual cell supports square_tube, rectangle, rod and tube");
}

/// Elasticity and density of a material: an independent copy of the handbook values that cell files
/// can name.
struct MaterialConstants {
  const char* name;
  double E_GPa, nu, density_kg_m3;
};
constexpr MaterialConstants kMaterials[] = {
    {"aluminium", 70, 0.3, 2700},           {"aluminium_6061", 68.3, 0.33, 2710},
    {"aluminium_6082", 70, 0.3, 2700},      {"aluminium_7075", 71.0, 0.33, 2800},
    {"brass_cuzn39pb3", 97, 0.34, 8470},    {"cast_iron_gjl250", 110, 0.26, 7200},
    {"cast_iron_gjs400", 169, 0.275, 7100}, {"magnesium_az91", 45, 0.35, 1810},
    {"stainless_steel", 200, 0.3, 7900},    {"steel", 210, 0.3, 7850},
    {"titanium_ti6al4v", 110, 0.31, 4430},
};

/// A material by name, by numbers, or by name with some numbers overridden.
MaterialConstants ReadMaterial(const TomlFields& fields) {
  MaterialConstants named{"", 0, 0.3, 0};
  const bool by_name = fields.Has("material");
  if (by_name) {
    const std::string name = fields.Text("material");
    const auto* const found = std::find_if(std::begin(kMaterials), std::end(kMaterials),
                                           [&](const auto& m) { return name == m.name; });
    if (found == std::end(kMaterials)) fields.Fail("material", "unknown material");
    named = *found;
  }
  const auto number = [&](const char* key, double otherwise) {
    return by_name ? fields.Number(key, otherwise) : fields.Number(key);
  };
  return {named.name, number("youngs_modulus_GPa", named.E_GPa),
          fields.Number("poisson_ratio", named.nu), number("density_kg_m3", named.density_kg_m3)};
}

RodSegment ReadSegment(const TomlFields& fields, const MaterialConstants& material) {
  const SectionConstants section = ReadSection(fields);
  const double E = material.E_GPa * 1e9;
  const double G = E / (2 * (1 + material.nu));
  return {.length_m = fields.Number("length_mm") * 1e-3,
          .area_m2 = section.area,
          .EI_x = E * section.I_x,
          .EI_y = E * section.I_y,
          .GJ = G * section.J,
          .GA = G * section.area,
          .EA = E * section.area,
          .weight_kg_m = material.density_kg_m3 * section.area};
}

void ReadTool(const TomlFields& tool, CellDescription& cell) {
  const std::string model = tool.Text("model");
  cell.mount_mass_kg = tool.Number("mount_mass_kg", 0);
  cell.rigid_tool = model == "rigid";
  cell.sheared_tool = model == "timoshenko";
  if (cell.rigid_tool) {
    cell.tip_F = tool.Vector("tcp_mm") * 1e-3;
    return;
  }
  const std::vector<TomlFields> segments = tool.Tables("segment");
  for (const TomlFields& segment : segments) {
    const bool own = segment.Has("material") || segment.Has("youngs_modulus_GPa");
    cell.rod.push_back(ReadSegment(segment, ReadMaterial(own ? segment : tool)));
  }
  if (segments.empty()) cell.rod.push_back(ReadSegment(tool, ReadMaterial(tool)));
  for (const RodSegment& segment : cell.rod) cell.tip_F.z() += segment.length_m;
}

JointDescription ReadJoint(const TomlFields& fields) {
  JointDescription joint;
  joint.prismatic = fields.Text("type", "revolute") == "prismatic";
  joint.a_m = fields.Number("a_mm") * 1e-3;
  joint.alpha_rad = RadFromDeg(fields.Number("alpha_deg"));
  joint.d_m = fields.Number("d_mm") * 1e-3;
  joint.offset_rad = RadFromDeg(fields.Number("theta_offset_deg", 0));
  joint.sign = fields.Number("sign", 1);
  const char* min_key = joint.prismatic ? "min_mm" : "min_deg";
  const char* max_key = joint.prismatic ? "max_mm" : "max_deg";
  const double unit = joint.prismatic ? 1e-3 : RadFromDeg(1);
  if (fields.Has(min_key)) joint.min = fields.Number(min_key) * unit;
  if (fields.Has(max_key)) joint.max = fields.Number(max_key) * unit;
  joint.link_mass_kg = fields.Number("link_mass_kg", 0);
  joint.link_com_m = fields.Vector("link_com_mm", Vec3::Zero()) * 1e-3;
  joint.compliance = fields.Number("compliance_rad_per_Nm", 0);
  return joint;
}

}  // namespace

CellDescription ReadCellFile(const std::string& path) {
  const toml::table root = ParseTomlFile(path);
  const TomlFields file(root, path);
  CellDescription cell;
  const TomlFields robot = file.Table("robot");
  cell.name = robot.Text("name", "robot");
  cell.proximal_dh = robot.Text("convention") == "mdh";
  cell.gravity_W = robot.Vector("gravity_m_s2", cell.gravity_W);
  cell.X_WB = MotionFromXyzMmRpyDeg(robot.Vector("base_xyz_mm", Vec3::Zero()),
                                    robot.Vector("base_rpy_deg", Vec3::Zero()));
  for (const TomlFields& joint : robot.Tables("joint")) cell.joints.push_back(ReadJoint(joint));
  if (cell.joints.empty()) robot.Fail("joint", "at least one joint is needed");
  if (file.Has("tool")) ReadTool(file.Table("tool"), cell);
  cell.payload_cog_F = cell.tip_F;
  if (file.Has("payload")) {
    cell.payload_cog_F = file.Table("payload").Vector("cog_mm", cell.tip_F * 1e3) * 1e-3;
  }
  if (file.Has("measurement")) {
    cell.reference_temperature_C = file.Table("measurement").Number("reference_temperature_C", 22);
  }
  return cell;
}

}  // namespace virtual_cell
