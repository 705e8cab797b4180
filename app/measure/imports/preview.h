// Preview of an import as text: the meaning and unit assigned to each column.
#pragma once

#include <string>
#include <string_view>

#include "app/measure/imports/import_table.h"
#include "firmware-like/result.h"

namespace plumbline::measure {

/// Encoding, layout, each column with its meaning, unit and reason, the number of rows, the first
/// rows as they would be written, and rejected lines with their reasons.
std::string PreviewText(const UnderstoodFile& file, const ImportedTable& table);

/// Parameters of a `calibration_<date>.yaml` of ROS robot_calibration, which holds results rather
/// than measurements, and what to do with them. An error if it is not such a file.
Result<std::string> RobotCalibrationText(std::string_view yaml);

}  // namespace plumbline::measure
