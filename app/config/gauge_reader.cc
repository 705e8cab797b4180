#include "app/config/gauge_reader.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/config/daemon_settings.h"
#include "app/config/nearest_word.h"
#include "firmware-like/status/gauge_status.h"

namespace plumbline::config {
namespace {

using status::kMaxGauges;

/// Adds a fault unless the cell has a gauge of that name.
void CheckArtefact(const TomlTable& table, const std::string& name, const model::CellModel& cell) {
  const auto found =
      std::find_if(cell.artefacts.begin(), cell.artefacts.end(),
                   [&name](const model::Artefact& artefact) { return artefact.name == name; });
  if (found == cell.artefacts.end()) {
    std::vector<std::string> names;
    for (const model::Artefact& artefact : cell.artefacts) {
      if (artefact.kind == model::ArtefactKind::kGauge) names.push_back(artefact.name);
    }
    const std::string nearest = NearestWord(name, names, 0.4);
    table.AddFault("artefact",
                   nearest.empty()
                       ? "is not an [[artefact]] of the cell; add one of kind \"gauge\""
                       : "is not an [[artefact]] of the cell; did you mean " + nearest + "?");
  } else if (found->kind != model::ArtefactKind::kGauge) {
    table.AddFault("artefact", "is not of kind \"gauge\" in the cell");
  }
}

GaugeConfig GaugeFromToml(const TomlTable& table) {
  GaugeKeys keys;
  ReadKeys(table, keys);
  GaugeConfig found;
  found.artefact = keys.artefact;
  found.sigma_m = keys.sigma_m;
  found.connection.device = keys.device;
  found.connection.unit = keys.unit;
  found.connection.format = gauge::FindGaugeFormat(keys.format);
  if (found.connection.format == nullptr) return found;
  os::SerialSettings& line = found.connection.line;
  line = found.connection.format->line;
  line.baud = keys.baud.value_or(line.baud);
  line.data_bits = keys.data_bits.value_or(line.data_bits);
  line.stop_bits = keys.stop_bits.value_or(line.stop_bits);
  line.parity = keys.parity.value_or(line.parity);
  if (const std::string fault = os::FaultOf(line); !fault.empty()) table.AddFault("baud", fault);
  return found;
}

}  // namespace

std::vector<GaugeConfig> GaugesFromToml(const TomlTable& root, const model::CellModel* cell) {
  std::vector<GaugeConfig> gauges;
  const std::vector<TomlTable> tables = root.Tables("gauge");
  if (tables.size() > kMaxGauges) {
    root.AddFault("gauge",
                  fmt::format("is given {} times; at most {} gauges", tables.size(), kMaxGauges));
  }
  for (const TomlTable& table : tables) {
    GaugeConfig one = GaugeFromToml(table);
    if (cell != nullptr && !one.artefact.empty()) CheckArtefact(table, one.artefact, *cell);
    for (const GaugeConfig& other : gauges) {
      if (!one.artefact.empty() && other.artefact == one.artefact) {
        table.AddFault("artefact", "is used for two gauges");
      }
      if (!one.connection.device.empty() && other.connection.device == one.connection.device) {
        table.AddFault("device", "is used for two gauges");
      }
    }
    if (!one.connection.device.empty() && one.connection.device.front() != '/') {
      table.AddFault("device", "is not the path of a device, such as /dev/serial/by-id/...");
    }
    gauges.push_back(std::move(one));
  }
  return gauges;
}

}  // namespace plumbline::config
