#include "app/measure/table/numbered_rows.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "app/base/config/carried_numbers.h"
#include "firmware-like/loads/numbered_load.h"

namespace plumbline::measure {
namespace {

std::string ItemsText(const model::CellModel& cell) {
  return cell.payload_items.empty() ? "no [[payload.item]]"
                                    : "[[payload.item]] " + config::ItemNumbersText(cell);
}

std::optional<std::string> ToolProblem(const model::CellModel& cell, const MeasuredRow& row) {
  if (loads::ToolIndexOf(cell, row.tool_number)) return std::nullopt;
  if (!row.tool_number) {
    return fmt::format(
        "line {}: tool is empty or not a whole number, and the cell declares tools {}: write the "
        "number of the tool that was mounted",
        row.line, config::ToolNumbersText(cell));
  }
  return fmt::format(
      "line {}: tool {} is not declared, the cell declares {}: correct the number, or add a "
      "[[tool]] with number = {}",
      row.line, *row.tool_number, config::ToolNumbersText(cell), *row.tool_number);
}

std::optional<std::string> ItemProblem(const model::CellModel& cell, const MeasuredRow& row) {
  if (!row.payload_item) {
    if (cell.payload_items.empty()) return std::nullopt;
    return fmt::format(
        "line {}: payload_item is empty or not a whole number, and the cell declares {}: write the "
        "number of the item that was carried, 0 for none",
        row.line, ItemsText(cell));
  }
  if (*row.payload_item == 0 || loads::ItemOf(cell, row.payload_item)) return std::nullopt;
  return fmt::format(
      "line {}: payload_item {} is not declared, the cell declares {}: correct the number (0: no "
      "item), or add a [[payload.item]] with number = {}",
      row.line, *row.payload_item, ItemsText(cell), *row.payload_item);
}

}  // namespace

std::optional<std::string> NumberProblem(const model::CellModel& cell, const MeasuredTable& table) {
  if (!table.recorded.tool && cell.tools() > 1) {
    return fmt::format(
        "has no column tool, and the cell declares tools {}: add the column with the number of "
        "the tool that was mounted in each row, or leave only that [[tool]] in the cell",
        config::ToolNumbersText(cell));
  }
  for (const MeasuredRow& row : table.rows) {
    if (table.recorded.tool) {
      if (auto problem = ToolProblem(cell, row)) return problem;
    }
    if (table.recorded.item) {
      if (auto problem = ItemProblem(cell, row)) return problem;
    }
  }
  return std::nullopt;
}

std::vector<std::string> NumberNotes(const model::CellModel& cell, const MeasuredTable& table) {
  std::vector<std::string> notes;
  std::set<int> named;
  for (const MeasuredRow& row : table.rows) {
    if (row.tool_number) named.insert(*row.tool_number);
  }
  if (named.size() > 1 && !cell.tool.number) {
    notes.push_back(fmt::format(
        "the rows name tools {}, but the cell declares one tool without a number, which is used "
        "for all rows: declare each as a [[tool]] with its number",
        fmt::join(named, ", ")));
  }
  if (!table.recorded.item && !cell.payload_items.empty()) {
    notes.emplace_back(
        "payload_item was not recorded: all rows are taken to be without the cell's "
        "[[payload.item]]");
  }
  return notes;
}

}  // namespace plumbline::measure
