// cell.toml -> CellModel, in SI, with all its faults and warnings.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "app/config/fault.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline {

/// Key of the warning that a fitted model was changed after its validation.
inline constexpr std::string_view kFingerprintKey = "domain.fingerprint";

/// Reads a cell by its text; a pure function. `file` only names it in faults.
///
/// Required are schema, [robot] with name and convention, at least one [[robot.joint]] with a_mm,
/// alpha_deg and d_mm, and [tool]. Where they are absent: theta_offset_deg is 0, sign 1, the base
/// stands in the origin of the measurement frame, gravity is (0, 0, -9.80665), said as a warning.
/// A prismatic joint has min_mm and max_mm in place of degrees, and its pair of [domain] q_deg is
/// in mm. A material by name may be refined by youngs_modulus_GPa and the like beside it.
///
/// Where [domain] has a fingerprint that is not the file's, the fitted model was changed after its
/// validation: a warning, and domain->as_validated is false.
///
/// @param faults  gets what is wrong, and warnings for what remains unknown (torques without link
///                masses, a guessed centre of mass, no payload)
/// @return        the cell; nothing where this text has a fault
std::optional<CellModel> CellFromText(std::string_view text, const std::string& file,
                                      FaultList& faults);

/// CellFromText of a file's content; a file that cannot be read is a fault.
std::optional<CellModel> ReadCell(const std::string& path, FaultList& faults);

}  // namespace plumbline
