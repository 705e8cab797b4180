// Reader of the [[effect]] tables of a cell.
#pragma once

#include <cstdint>
#include <vector>

#include "app/base/config/toml_reader.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::config {

/// Reads one [[effect]]. Id and parameters must be in the catalogue (firmware-like/effects); a
/// stated unit must match the catalogue, and a parameter's joint must have the type that the
/// parameter applies to. The covariance covers the numeric parameters in their order; it must be
/// symmetric and positive semidefinite. Faults are added to the table's fault list.
/// @param prismatic  bit mask of the prismatic joints; see EffectTerm
model::WrittenEffect EffectFromToml(const TomlTable& table, int joint_count,
                                    std::uint32_t prismatic = 0);

}  // namespace plumbline::config
