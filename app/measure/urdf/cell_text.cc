#include "app/measure/urdf/cell_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/base/text/json_text.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::measure {
namespace {

/// A decimal number without superfluous zeros, but with a point, as TOML wants it.
std::string Decimal(double value, int digits) {
  std::string text = fmt::format("{:.{}f}", value, digits);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text += '0';
  return text == "-0.0" ? "0.0" : text;
}

std::string Millimetres(double value_m) {
  return Decimal(value_m * kMmPerMetre, 9);
}
std::string Degrees(double value_rad) {
  return Decimal(value_rad * kDegPerRad, 10);
}
std::string Millimetres(const Vec3& v) {
  return fmt::format("[{}, {}, {}]", Millimetres(v.x()), Millimetres(v.y()), Millimetres(v.z()));
}

/// A name within a comment or a basic string: escaped, valid UTF-8, of limited length.
std::string Plain(std::string_view name) {
  std::string plain = text::JsonText(nlohmann::json(std::string(name.substr(0, 100))));
  std::replace(plain.begin(), plain.end(), '\x7f', ' ');  // which TOML does not allow
  return plain.substr(1, plain.size() - 2);
}

std::string RowText(const model::Joint& row, const ChainJoint& joint) {
  const bool prismatic = row.type == model::JointType::kPrismatic;
  std::string text = fmt::format("\n# joint {}, link {}\n[[robot.joint]]\n", Plain(joint.name),
                                 Plain(joint.child));
  if (prismatic) text += "type = \"prismatic\"\n";
  text += fmt::format("a_mm = {}\nalpha_deg = {}\n", Millimetres(row.a_m), Degrees(row.alpha_rad));
  if (row.beta_rad != 0) text += fmt::format("beta_deg = {}\n", Degrees(row.beta_rad));
  if (row.gamma_rad != 0) text += fmt::format("gamma_deg = {}\n", Degrees(row.gamma_rad));
  text += fmt::format("d_mm = {}\ntheta_offset_deg = {}\nsign = {}\n", Millimetres(row.d_m),
                      Degrees(row.theta_offset_rad), row.sign);
  const auto limit = [&](double value) { return prismatic ? Millimetres(value) : Degrees(value); };
  const char* unit = prismatic ? "mm" : "deg";
  if (std::isfinite(row.min)) text += fmt::format("min_{} = {}\n", unit, limit(row.min));
  if (std::isfinite(row.max)) text += fmt::format("max_{} = {}\n", unit, limit(row.max));
  if (row.link_mass_kg) text += fmt::format("link_mass_kg = {}\n", Decimal(*row.link_mass_kg, 6));
  if (row.link_com_m) text += fmt::format("link_com_mm = {}\n", Millimetres(*row.link_com_m));
  return text;
}

}  // namespace

std::string CellText(const model::Robot& robot, const JointChain& chain,
                     const std::string& source) {
  const Vec3 rpy = RollPitchYawFromRotation(robot.X_WB.R);
  std::string text = fmt::format(
      "# Imported by `plumbline import-urdf` from {}, links {} to {}.\n"
      "# A URDF has no joint stiffness: without compliance_rad_per_Nm the joints are rigid.\n\n"
      "schema = 1\n\n[robot]\nname = \"{}\"\nconvention = \"dh\"\n"
      "gravity_m_s2 = [0.0, 0.0, -9.80665]  # in the measurement frame, here link {}\n"
      "base_xyz_mm = {}\nbase_rpy_deg = [{}, {}, {}]\n",
      Plain(source), Plain(chain.base), Plain(chain.tip), Plain(robot.name), Plain(chain.base),
      Millimetres(robot.X_WB.p), Degrees(rpy.x()), Degrees(rpy.y()), Degrees(rpy.z()));
  for (std::size_t i = 0; i < robot.joints.size(); ++i) {
    text += RowText(robot.joints[i], chain.joints[i]);
  }
  text += fmt::format(
      "\n[tool]\nmodel = \"rigid\"\ntcp_mm = [0.0, 0.0, 0.0]  # tip in the flange frame, here link "
      "{}\n\n# [payload]\n# cog_mm = [0.0, 0.0, 0.0]  # the load's centre of gravity in the flange "
      "frame\n",
      Plain(chain.tip));
  return text;
}

}  // namespace plumbline::measure
