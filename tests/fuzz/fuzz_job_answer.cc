// Fuzzer: arbitrary text as the answer of a diagnosis and as further columns of a probe, both from
// the plant's database: compared or not, but never trusted.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "app/base/text/json_text.h"
#include "app/plant/jobs/cell_data.h"
#include "app/plant/jobs/comparison.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace plumbline;  // NOLINT(google-build-using-namespace)
  const std::string text(reinterpret_cast<const char*>(data), size);
  plant::JobAnswer answer;
  answer.output = text::JsonOrNull(text);
  cell::JournalRow row;
  plant::AddFurtherColumns(answer.output, std::vector<model::Joint>(6), row);
  const plant::CellComparison same = plant::CompareAnswers("line/cell", answer, answer);
  // An answer is equal to itself, or cannot be compared.
  if (same.error && same.change != plant::CellComparison::Change::kEqual) std::abort();
  if (same.error && !std::isfinite(same.error->log_sd)) std::abort();
  const auto all = plant::CompareCells({same, same, same});
  if (all.IsWorse() || plant::ComparisonText(all).empty()) std::abort();
  static_cast<void>(text::JsonText(plant::ComparisonJson(all)));
  return 0;
}
