// Reader of the [tool] table of a cell.
#pragma once

#include "app/config/toml_reader.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::config {

/// Reads [tool]: a rigid tool with tcp_mm, a uniform beam, or a stepped beam of [[tool.segment]],
/// each with its section and material. Faults are added to the table's fault list; the returned
/// tool is then incomplete.
model::Tool ToolFromToml(const TomlTable& table);

/// Allowed range of a number in [tool]; keys without a range of their own have that of a section
/// dimension.
NumberRange RangeOfToolKey(std::string_view key);

}  // namespace plumbline::config
