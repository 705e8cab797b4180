// The [[effect]] tables of a cell.
#pragma once

#include <cstdint>
#include <vector>

#include "app/config/toml_reader.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline {

/// Reads one [[effect]]. Its id and parameters are those of the catalogue (firmware-like/effects);
/// a unit, where written, must be the catalogue's, and a joint of the type that the parameter is
/// of. The covariance is over the parameters that are numbers, in their order, symmetric and
/// positive semidefinite. Faults go to the table's list.
/// @param prismatic  the prismatic joints as bits; see EffectTerm
WrittenEffect EffectFromToml(const TomlTable& table, int joint_count, std::uint32_t prismatic = 0);

}  // namespace plumbline
