#include "app/measure/diagnosis/row_condition.h"

#include <fmt/format.h>

namespace plumbline::measure {

std::string TextOf(const RowCondition& condition) {
  if (!condition.name.empty()) return condition.column + " " + condition.name;
  return fmt::format("{} of {:.6g} or {}", condition.column, condition.limit,
                     condition.above ? "more" : "less");
}

}  // namespace plumbline::measure
