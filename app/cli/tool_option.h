// Option --tool of commands that compute with one of several tools of a cell.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "firmware-like/model/cell_model.h"
#include "firmware-like/result.h"

namespace plumbline::cli {

void AddToolOption(CLI::App& command, std::optional<int>& number);

/// Index of the tool to use: the first, unless a number is given.
/// @return  error, with the declared numbers, if the cell does not declare that tool
Result<int> ToolChoice(const model::CellModel& cell, const std::optional<int>& number);

/// "tool 4 of 4, 7", with a hint if it was not chosen; empty if the cell has one tool.
std::string UsedToolText(const model::CellModel& cell, int index, const std::optional<int>& number);

}  // namespace plumbline::cli
