// Reader of the payload items of a cell.
#pragma once

#include <vector>

#include "app/base/config/toml_reader.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::config {

/// Reads each [[payload.item]]: its number, mass and centre of gravity. Faults are added to the
/// table's fault list.
std::vector<model::PayloadItem> PayloadItemsFromToml(const TomlTable& payload);

}  // namespace plumbline::config
