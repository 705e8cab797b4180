// Fuzzer: arbitrary bytes as an export of an instrument, as a mapping file or as YAML: rows and
// reasons that account for every record, a mapping that survives being written, never a crash.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "app/measure/imports/ask.h"
#include "app/measure/imports/preview.h"

using namespace plumbline;

namespace {

void CheckTable(std::string_view bytes) {
  const std::size_t size = bytes.size();
  measure::ImportOptions options;
  options.length_unit = "mm";
  options.angle_unit = "rad";
  options.temperature_unit = "C";
  options.artefact = "dial";
  options.permissible_error = measure::PermissibleError{0.01, 0.005};
  config::FaultList faults;
  const auto file = measure::Understand(
      bytes, "f.csv", size % 2 == 0 ? measure::FileRole::kMeasured : measure::FileRole::kJoints, {},
      "", options, faults);
  if (file.meanings.size() != file.layout.names.size()) std::abort();
  const auto table = RowsOf(file, options);
  if (table.rows.size() != file.layout.records.size()) std::abort();
  if (table.rejected.size() > table.rows.size()) std::abort();
  for (const auto& row : table.rows) {
    for (const auto& [name, value] : row.numbers) {
      if (std::isnan(value)) std::abort();
    }
  }
  if (PreviewText(file, table).empty() || MeasuredCsv(table).empty()) std::abort();
  config::FaultList of_mapping;
  const auto kept =
      measure::MappingFromText(TextOfMapping(measure::MappingOf(file)), "m.toml", of_mapping);
  // Units that are not known are faults of the file, and of the mapping made from it.
  if (!kept && !faults.HasFaults()) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  config::FaultList faults;
  switch (data[0] % 4) {
    case 0: {
      const auto mapping = measure::MappingFromText(text, "m.toml", faults);
      if (mapping.has_value() == faults.HasFaults()) std::abort();
      break;
    }
    case 1: {
      const auto shown = measure::RobotCalibrationText(text);
      if (!shown && shown.error().empty()) std::abort();
      break;
    }
    default:
      CheckTable(text);
  }
  return 0;
}
