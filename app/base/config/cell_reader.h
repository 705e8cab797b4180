// Reader of cell.toml: text to CellModel in SI units, with all faults and warnings.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/base/config/fault.h"
#include "app/base/config/toml_reader.h"
#include "firmware-like/model/artefact.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::config {

// Reader of the tools of a cell.

/// Reads [tool], or each [[tool]]. Each of several tools has a `number` of its own.
/// @return  at least one tool, unless a fault was added
std::vector<model::Tool> ToolsFromToml(const TomlTable& root);

/// Reads one tool: a rigid tool with tcp_mm, a uniform beam, or a stepped beam of [[tool.segment]],
/// each with its section and material. Faults are added to the table's fault list; the returned
/// tool is then incomplete.
model::Tool ToolFromToml(const TomlTable& table);

/// Allowed range of a number in [tool]; keys without a range of their own have that of a section
/// dimension.
NumberRange RangeOfToolKey(std::string_view key);

// Reader of the [[effect]] tables of a cell.

/// Reads one [[effect]]. Id and parameters must be in the catalogue (firmware-like/effects); a
/// stated unit must match the catalogue, and a parameter's joint must have the type that the
/// parameter applies to. The covariance covers the numeric parameters in their order; it must be
/// symmetric and positive semidefinite. Faults are added to the table's fault list.
/// @param prismatic  bit mask of the prismatic joints; see EffectTerm
model::WrittenEffect EffectFromToml(const TomlTable& table, int joint_count,
                                    std::uint32_t prismatic = 0);

// Reader of a cell's artefacts and of the known distances between them.

/// The `[[artefact]]` tables, in order. Faults: a name twice, a key that does not belong to the
/// kind, a normal or direction of zero length.
std::vector<model::Artefact> ArtefactsFromToml(const TomlTable& root);

/// The `[[distance]]` tables, in order. Faults: an unknown name, the same artefact twice, an
/// artefact that is no point, artefacts of different frames.
std::vector<model::KnownDistance> DistancesFromToml(const TomlTable& root,
                                                    const std::vector<model::Artefact>& artefacts);

// Reader of the conditions that a corrected cell was fitted to.

/// Reads [domain]: the ranges of the fitted rows, and the standard deviation of the residual with
/// its growth with the distance from the measured poses. A model that was edited after it was
/// fitted is marked as not validated, with a warning. Faults are added to the table's fault list.
/// @param table     the table [domain] of `document`
/// @param document  the whole cell file, from which the fingerprint is computed
model::Domain DomainFromToml(const TomlTable& table, const model::Robot& robot,
                             const TomlDocument& document);

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
