// Reader of the conditions that a corrected cell was fitted to.
#pragma once

#include "app/base/config/toml_reader.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::config {

/// Reads [domain]: the ranges of the fitted rows, and the standard deviation of the residual with
/// its growth with the distance from the measured poses. A model that was edited after it was
/// fitted is marked as not validated, with a warning. Faults are added to the table's fault list.
/// @param table     the table [domain] of `document`
/// @param document  the whole cell file, from which the fingerprint is computed
model::Domain DomainFromToml(const TomlTable& table, const model::Robot& robot,
                             const TomlDocument& document);

}  // namespace plumbline::config
