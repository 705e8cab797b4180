#include "app/base/config/carried_numbers.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <vector>

#include "firmware-like/deflection/uncertainty.h"

namespace plumbline::config {
namespace {

std::string CarriedText(int item) {
  return item == 0 ? "an arm without payload item" : fmt::format("payload item {}", item);
}

}  // namespace

std::string ToolNumbersText(const model::CellModel& cell) {
  std::vector<int> numbers;
  for (int k = 0; k < cell.tools(); ++k) numbers.push_back(cell.ToolAt(k).number.value_or(0));
  return fmt::format("{}", fmt::join(numbers, ", "));
}

std::string ItemNumbersText(const model::CellModel& cell) {
  std::vector<int> numbers;
  for (const model::PayloadItem& item : cell.payload_items) numbers.push_back(item.number);
  return numbers.empty() ? "none" : fmt::format("{}", fmt::join(numbers, ", "));
}

NumberAdvice AdviceOn(const UndeclaredNumber& undeclared, const model::CellModel& cell) {
  using Kind = UndeclaredNumber::Kind;
  if (undeclared.kind == Kind::kNone) return {};
  const bool tool = undeclared.kind == Kind::kTool;
  const char* name = tool ? "tool" : "payload item";
  const char* table = tool ? "[[tool]]" : "[[payload.item]]";
  const std::string declared =
      tool ? ToolNumbersText(cell) : ItemNumbersText(cell) + ", 0 for none";
  if (!undeclared.number) {
    return {fmt::format("the controller reports no {} number (declared: {})", name, declared),
            fmt::format("let the controller report it: {} of the robot profile",
                        tool ? "[tool_number]" : "[payload_item]")};
  }
  return {fmt::format("{} {} is not declared (declared: {})", name, *undeclared.number, declared),
          fmt::format("correct the number in the controller, or add a {} with number = {}", table,
                      *undeclared.number)};
}

std::string UnmeasuredToolText(const model::CellModel& cell, int tool) {
  if (deflection::ToolCovered(cell, tool)) return "";
  return fmt::format("tool {} was not measured (measured: {})",
                     cell.ToolAt(tool).number.value_or(0), fmt::join(cell.domain->tools, ", "));
}

std::string UnmeasuredItemText(const model::CellModel& cell, int item) {
  if (deflection::ItemCovered(cell, item)) return "";
  const std::string measured =
      cell.domain->payload_items
          ? fmt::format("measured: {}", fmt::join(*cell.domain->payload_items, ", "))
          : "the model does not state which items were";
  return fmt::format("{} was not measured ({})", CarriedText(item), measured);
}

std::string UnmeasuredText(const model::CellModel& cell, int tool, int item) {
  const std::string of_tool = UnmeasuredToolText(cell, tool);
  const std::string of_item = UnmeasuredItemText(cell, item);
  return of_tool + (of_tool.empty() || of_item.empty() ? "" : "; ") + of_item;
}

}  // namespace plumbline::config
