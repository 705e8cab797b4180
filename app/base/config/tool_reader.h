// Reader of the tools of a cell.
#pragma once

#include <vector>

#include "app/base/config/toml_reader.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::config {

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

}  // namespace plumbline::config
