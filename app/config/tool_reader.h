// The [tool] table of a cell.
#pragma once

#include "app/config/toml_reader.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline {

/// Reads [tool]: a rigid tool with tcp_mm, one beam, or a stepped one of [[tool.segment]], each
/// with its section and material. Faults go to the table's list; the answer is then incomplete.
Tool ToolFromToml(const TomlTable& table);

}  // namespace plumbline
