#include "drivers/plc/register_map.h"

#include <vector>

namespace plumbline::plc {

const char* NameOf(FieldType type) {
  switch (type) {
    case FieldType::kU16:
      return "u16";
    case FieldType::kI16:
      return "i16";
    case FieldType::kU32:
      return "u32";
    case FieldType::kI32:
      return "i32";
    case FieldType::kFloat:
      return "float32";
    case FieldType::kU64:
      return "u64";
  }
  return "?";
}

std::span<const MapField> registers::Fields() {
  static const std::vector<MapField> all = [] {
    std::vector<MapField> joined;
    for (const auto block : {StateFields(), ResultFields(), RobotFields(), MonitoringFields()}) {
      joined.insert(joined.end(), block.begin(), block.end());
    }
    return joined;
  }();
  return all;
}

}  // namespace plumbline::plc
