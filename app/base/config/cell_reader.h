// Reader of cell.toml: text to CellModel in SI units, with all faults and warnings.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "app/base/config/fault.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::config {

/// Key of the warning that a fitted model was edited after its validation.
inline constexpr std::string_view kFingerprintKey = "domain.fingerprint";

/// Parses the text of a cell file. Pure function; `file` is only the name used in faults.
///
/// Required: schema, [robot] with name and convention, at least one [[robot.joint]] with a_mm,
/// alpha_deg and d_mm, and [tool]. Defaults: theta_offset_deg 0, sign 1, the base at the origin of
/// the measurement frame, gravity (0, 0, -9.80665) with a warning. A prismatic joint has min_mm and
/// max_mm instead of degrees, and its pair in [domain] q_deg is in mm. Keys such as
/// youngs_modulus_GPa override the values of a named material.
///
/// If [domain] has a fingerprint that does not match the file, the fitted model was edited after
/// its validation: a warning is added and domain->as_validated is false.
///
/// @param faults  receives the faults, and warnings for what remains unknown (torques without link
///                masses, an assumed centre of mass, no payload)
/// @return        the cell, or nullopt if this text has a fault
std::optional<model::CellModel> CellFromText(std::string_view text, const std::string& file,
                                             FaultList& faults);

/// CellFromText() on the content of a file; a file that cannot be read is a fault.
std::optional<model::CellModel> ReadCell(const std::string& path, FaultList& faults);

}  // namespace plumbline::config
