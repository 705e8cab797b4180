// Recorded joint rows, replayed at a fixed rate instead of a program.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tests/virtual_cell/rigid_motion.h"

namespace virtual_cell {

struct ReplayRow {
  Joints q;  ///< [rad]
  std::optional<double> payload_kg, temperature_C;
};

/// Reads the columns q1_deg.., payload_kg and temp_C of a CSV file with a header row.
/// @throws std::runtime_error with file, line and reason, e.g. a missing joint column
std::vector<ReplayRow> ReadJointRows(const std::string& path, int joints);

}  // namespace virtual_cell
