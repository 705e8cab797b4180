#include "app/cli/tool_option.h"

#include <fmt/format.h>

#include "app/base/config/carried_numbers.h"
#include "app/cli/number_option.h"

namespace plumbline::cli {

void AddToolOption(CLI::App& command, std::optional<int>& number) {
  command.add_option("--tool", number, "Number of the [[tool]] to use; default: the first")
      ->check(WholeNumberWithin(0, 65535));
}

Result<int> ToolChoice(const model::CellModel& cell, const std::optional<int>& number) {
  if (!number) return 0;
  for (int index = 0; index < cell.tools(); ++index) {
    if (cell.ToolAt(index).number == number) return index;
  }
  if (!cell.tool.number) {
    return Error{
        fmt::format("--tool {}: the cell's only tool has no number; omit --tool", *number)};
  }
  return Error{fmt::format("--tool {}: is not declared; the cell declares {}", *number,
                           config::ToolNumbersText(cell))};
}

std::string UsedToolText(const model::CellModel& cell, int index,
                         const std::optional<int>& number) {
  if (cell.tools() == 1) return "";
  return fmt::format("tool {} of {}{}", cell.ToolAt(index).number.value_or(0),
                     config::ToolNumbersText(cell), number ? "" : " (choose with --tool)");
}

}  // namespace plumbline::cli
