#include "app/base/config/gauge_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <system_error>
#include <tuple>
#include <utility>

#include "app/base/config/daemon_settings.h"
#include "app/base/text/nearest_word.h"
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
    const std::string nearest = text::NearestWord(name, names, 0.4);
    table.AddFault("artefact",
                   nearest.empty()
                       ? "is not an [[artefact]] of the cell; add one of kind \"gauge\""
                       : "is not an [[artefact]] of the cell; did you mean " + nearest + "?");
  } else if (found->kind != model::ArtefactKind::kGauge) {
    table.AddFault("artefact", "is not of kind \"gauge\" in the cell");
  }
}

/// "0fe7:4001", as lsusb prints it; nullopt: not of this form.
std::optional<std::pair<int, int>> UsbIdFrom(std::string_view text) {
  constexpr std::size_t kDigits = 4;
  if (text.size() != 2 * kDigits + 1 || text[kDigits] != ':') return std::nullopt;
  const auto number = [](std::string_view digits) -> std::optional<int> {
    int value = 0;
    const char* const end = digits.data() + digits.size();
    const auto [stop, error] = std::from_chars(digits.data(), end, value, 16);
    if (error != std::errc() || stop != end || value < 0) return std::nullopt;
    return value;
  };
  const auto vendor = number(text.substr(0, kDigits)), product = number(text.substr(kDigits + 1));
  if (!vendor || !product) return std::nullopt;
  return std::pair(*vendor, *product);
}

/// Adds faults for keys that the kind needs, and for those that it does not have.
void CheckKindKeys(const TomlTable& table, const GaugeKeys& keys) {
  const bool hid = keys.kind == gauge::GaugeKind::kHid;
  if (hid && keys.usb_id.empty()) {
    table.AddFault("usb_id", "is missing; lsusb shows it: ID 0fe7:4001");
  }
  if (!hid && keys.device.empty()) {
    table.AddFault("device", "is missing; ls /dev/serial/by-id shows the name");
  }
  const auto refuse = [&](std::string_view key, bool given, const char* of) {
    if (given) {
      table.AddFault(
          key, fmt::format("is for kind = \"{0}\" only: remove it, or set kind = \"{0}\"", of));
    }
  };
  refuse("device", hid && !keys.device.empty(), "serial");
  refuse("baud", hid && keys.baud, "serial");
  refuse("data_bits", hid && keys.data_bits, "serial");
  refuse("parity", hid && keys.parity, "serial");
  refuse("stop_bits", hid && keys.stop_bits, "serial");
  refuse("usb_id", !hid && !keys.usb_id.empty(), "hid");
  refuse("serial", !hid && !keys.serial.empty(), "hid");
}

GaugeConfig GaugeFromToml(const TomlTable& table) {
  GaugeKeys keys;
  ReadKeys(table, keys);
  CheckKindKeys(table, keys);
  GaugeConfig found;
  found.artefact = keys.artefact;
  found.sigma_m = keys.sigma_m;
  found.connection.kind = keys.kind;
  found.connection.device = keys.device;
  found.connection.unit = keys.unit;
  found.connection.hid.serial = keys.serial;
  if (!keys.usb_id.empty()) {
    const auto id = UsbIdFrom(keys.usb_id);
    if (!id) table.AddFault("usb_id", "is not of the form 0fe7:4001 (lsusb shows it)");
    std::tie(found.connection.hid.vendor_id, found.connection.hid.product_id) =
        id.value_or(std::pair(0, 0));
  }
  const bool hid = keys.kind == gauge::GaugeKind::kHid;
  found.connection.format =
      keys.format.value_or(gauge::FindGaugeFormat(hid ? "plain" : "mitutoyo"));
  if (hid) return found;
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
      const bool both_hid = one.connection.kind == gauge::GaugeKind::kHid &&
                            other.connection.kind == gauge::GaugeKind::kHid;
      const hid::HidName &name = one.connection.hid, &taken = other.connection.hid;
      const bool same_device =
          name.vendor_id == taken.vendor_id && name.product_id == taken.product_id &&
          (name.serial.empty() || taken.serial.empty() || name.serial == taken.serial);
      if (both_hid && same_device) {
        table.AddFault("usb_id", "is used for two gauges; distinguish them by `serial`");
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
