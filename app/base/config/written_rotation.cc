#include "app/base/config/written_rotation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace plumbline::config {

bool CouldBeRadians(const std::vector<double>& angles) {
  constexpr double kMaxAngle_rad = 2 * std::numbers::pi + 1e-3;
  const auto small = [](double angle) { return std::abs(angle) <= kMaxAngle_rad; };
  const auto zero = [](double angle) { return angle == 0; };
  return std::all_of(angles.begin(), angles.end(), small) &&
         !std::all_of(angles.begin(), angles.end(), zero);
}

WrittenRotation WrittenRotation::Of(const TomlTable& table, std::string_view key) {
  return {table.Numbers(key, kAsWritten, 3).value_or(std::vector<double>{0, 0, 0})};
}

Mat3 WrittenRotation::Rotation(bool radians) const {
  const Vec3 rpy(angles[0], angles[1], angles[2]);
  return RotationFromRollPitchYaw(radians ? rpy : Vec3(kRadPerDeg * rpy));
}

std::string WrittenRotation::InDegrees() const {
  std::string text;
  for (const double angle : angles) {
    text += fmt::format("{}{:.5g}", text.empty() ? "" : ", ", angle / kRadPerDeg);
  }
  return "[" + text + "]";
}

}  // namespace plumbline::config
