#include "firmware-like/loads/numbered_load.h"

#include <algorithm>

namespace plumbline::loads {

std::optional<int> ToolIndexOf(const model::CellModel& cell, std::optional<int> number) {
  if (cell.tools() == 1 && (!number || !cell.tool.number)) return 0;
  for (int index = 0; number && index < cell.tools(); ++index) {
    if (cell.ToolAt(index).number == number) return index;
  }
  return std::nullopt;
}

const model::PayloadItem* ItemOf(const model::CellModel& cell, std::optional<int> number) {
  const auto found = std::find_if(
      cell.payload_items.begin(), cell.payload_items.end(),
      [&](const model::PayloadItem& item) { return item.number == number.value_or(0); });
  return found == cell.payload_items.end() ? nullptr : &*found;
}

double ItemMass_kg(const model::CellModel& cell, std::optional<int> number) {
  const model::PayloadItem* item = ItemOf(cell, number);
  return item == nullptr ? 0 : item->mass_kg;
}

Payload WithItem(const Payload& payload, const model::PayloadItem* item) {
  if (item == nullptr) return payload;
  Payload both = payload;
  both.item = item->number;
  both.mass_kg += item->mass_kg;
  if (both.mass_kg > 0) {
    both.cog_F = (payload.mass_kg * payload.cog_F + item->mass_kg * item->cog_F) / both.mass_kg;
  }
  return both;
}

Payload LoadOf(const model::CellModel& cell, std::optional<double> payload_kg,
               std::optional<int> tool_number, std::optional<int> payload_item) {
  Payload payload;
  if (cell.payload_cog_F) payload = {payload_kg.value_or(0), *cell.payload_cog_F};
  payload.tool = ToolIndexOf(cell, tool_number).value_or(0);
  return WithItem(payload, ItemOf(cell, payload_item));
}

}  // namespace plumbline::loads
