// Fuzzer: arbitrary bytes as a table: rows, faults and warnings are consistent, never a crash.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "app/measure/table/csv.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  std::vector<plumbline::model::Joint> joints(1 + data[0] % 3);
  if (joints.size() == 2) joints[1].type = plumbline::model::JointType::kPrismatic;
  std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  plumbline::config::FaultList faults;
  const auto table = plumbline::measure::TableFromCsv(text, "measured.csv", joints, faults);
  if (table.has_value() == faults.HasFaults()) std::abort();
  if (!table) return 0;
  // No line is dropped silently: every line except the header is a row or has a warning.
  const auto ends = std::count(text.begin(), text.end(), '\n');
  const auto lines = ends + (text.back() == '\n' ? 0 : 1);
  const auto& unreadable = table->unreadable_lines;
  const auto unmeasured =
      std::count_if(table->unmeasured.begin(), table->unmeasured.end(),
                    [&](const plumbline::measure::MeasuredRow& row) {
                      return !std::binary_search(unreadable.begin(), unreadable.end(), row.line);
                    });
  const auto told = table->rows.size() + unreadable.size() + static_cast<std::size_t>(unmeasured);
  if (static_cast<std::size_t>(lines) != told + 1) std::abort();
  for (const plumbline::measure::MeasuredRow& row : table->rows) {
    if (!row.q.allFinite() || !std::isfinite(row.t_s.value_or(0))) std::abort();
    if (row.measured_W && !row.measured_W->allFinite()) std::abort();
  }
  return 0;
}
