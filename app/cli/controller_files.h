// Files of plumbline identify-controller: postures with reported poses, and the changed cell.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "app/base/config/fault.h"
#include "app/measure/controller/controller_sample.h"
#include "firmware-like/result.h"

namespace plumbline::cli {

/// Reads postures and reported poses from a table with the columns of measured.csv. The orientation
/// is qw, qx, qy, qz or three columns such as rx_rad, a_deg or roll_deg; see ConventionOfColumns().
/// @param convention  of three columns, in place of what their names say; empty: from the names
std::optional<measure::ControllerSample> ReadControllerSample(const std::string& path,
                                                              const model::CellModel& cell,
                                                              const std::string& convention,
                                                              config::FaultList& faults);

/// The sample as such a table.
std::string ControllerSampleCsv(const measure::ControllerSample& sample, const model::Robot& robot);

/// The cell file with the rows of the joints, the couplings, the base and the first tool's tcp_mm
/// of `changed`; everything else, byte by byte, as it was. Read back before it is returned.
/// @param before  the cell of the text
Result<std::string> ChangedCellText(std::string_view text, const model::CellModel& before,
                                    const model::CellModel& changed);

}  // namespace plumbline::cli
