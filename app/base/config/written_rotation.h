// Angles as written in a file, whose unit is still to be determined: degrees, or radians by
// mistake.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "app/base/config/limits.h"
#include "app/base/config/toml_reader.h"
#include "firmware-like/geometry/rotation.h"

namespace plumbline::config {

/// Range of angles that are read in either unit.
inline constexpr NumberRange kAsWritten{-100000, 100000};

/// True if the angles, read as radians, are within one turn, and are not all zero.
bool CouldBeRadians(const std::vector<double>& angles);

/// Roll, pitch and yaw as written in the file.
struct WrittenRotation {
  std::vector<double> angles = {0, 0, 0};

  /// Zero if the key is missing.
  static WrittenRotation Of(const TomlTable& table, std::string_view key);
  Mat3 Rotation(bool radians) const;
  /// What to write if the angles are radians: "[90, 0, -45]".
  std::string InDegrees() const;
};

}  // namespace plumbline::config
