// Reader of the conditions that a corrected cell was fitted to.
#pragma once

#include "app/config/toml_reader.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::config {

/// Reads [domain]: ranges of the fitted rows, residual and its growth with the distance from them.
/// A model that was edited after it was fitted is marked as not validated, with a warning. Faults
/// are added to the table's fault list.
/// @param table     [domain] of `document`
/// @param document  the whole cell, for its fingerprint
model::Domain DomainFromToml(const TomlTable& table, const model::Robot& robot,
                             const TomlDocument& document);

}  // namespace plumbline::config
