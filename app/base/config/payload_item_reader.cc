#include "app/base/config/payload_item_reader.h"

#include <fmt/format.h>

#include <map>

#include "app/base/config/limits.h"

namespace plumbline::config {

std::vector<model::PayloadItem> PayloadItemsFromToml(const TomlTable& payload) {
  std::vector<model::PayloadItem> items;
  std::map<int, int> line_of;
  for (const TomlTable& table : payload.Tables("item")) {
    model::PayloadItem item;
    const auto number = table.RequiredInteger("number", 1, kLargestNumber);
    item.number = number.value_or(item.number);
    item.mass_kg = table.RequiredNumber("mass_kg", {0, loads::kMaxPayload_kg}).value_or(0);
    item.cog_F = table.RequiredVector3("cog_mm", kPlaceRange).value_or(Vec3::Zero());
    if (number) {
      const auto [first, is_new] = line_of.emplace(*number, table.LineOf("number"));
      if (!is_new) {
        table.AddFault("number", fmt::format("is already the number of the item in line {}; give "
                                             "each [[payload.item]] its own",
                                             first->second));
      }
    }
    items.push_back(item);
  }
  return items;
}

}  // namespace plumbline::config
