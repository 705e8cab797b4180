// The [tool] table of a cell.
#pragma once

#include "app/config/toml_reader.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline {

/// Reads [tool]: a rigid tool with tcp_mm, one beam, or a stepped one of [[tool.segment]], each
/// with its section and material. Faults go to the table's list; the answer is then incomplete.
Tool ToolFromToml(const TomlTable& table);

/// What a number of the [tool] may be; of a key without a range of its own, that of a dimension of
/// a section.
NumberRange RangeOfToolKey(std::string_view key);

}  // namespace plumbline
