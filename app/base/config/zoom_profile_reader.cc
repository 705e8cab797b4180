#include "app/base/config/zoom_profile_reader.h"

#include <limits>

#include "app/base/config/toml_reader.h"
#include "app/base/config/wrong_file.h"

namespace plumbline::config {
namespace {

constexpr int kLastId = 0xFFFF;

zoom::HidField ReadField(const TomlTable& table) {
  using Meaning = zoom::HidField::Meaning;
  zoom::HidField field;
  field.meaning = table
                      .RequiredOneOf<Meaning>("value", {{"zoom_counts", Meaning::kZoomCounts},
                                                        {"focus_counts", Meaning::kFocusCounts},
                                                        {"moving", Meaning::kMoving},
                                                        {"digital_zoom", Meaning::kDigitalZoom},
                                                        {"moved", Meaning::kMoved}})
                      .value_or(field.meaning);
  field.at = table.RequiredInteger("at", 0, zoom::kMaxHidReportBytes - 1).value_or(0);
  field.bytes = table.RequiredInteger("bytes", 1, 4).value_or(1);
  const auto order = table.OneOf<bool>("byte_order", {{"big", true}, {"little", false}});
  if (field.bytes > 1 && !table.Has("byte_order")) {
    table.AddMissing("byte_order", "\"big\" or \"little\"");
  }
  field.big_endian = order.value_or(true);
  field.is_signed = table.Bool("signed").value_or(false);
  if (const auto mask = table.Integer("mask", 1, std::numeric_limits<int>::max())) {
    field.mask = static_cast<std::uint32_t>(*mask);
  }
  return field;
}

zoom::HidExchange ReadExchange(const TomlTable& table) {
  zoom::HidExchange exchange;
  for (const TomlTable& send : table.Tables("send")) {
    if (!send.Has("bytes")) send.AddMissing("bytes", "a list of bytes");
    std::vector<std::uint8_t> report;
    for (const int byte : send.Integers("bytes", 0, 0xFF).value_or(std::vector<int>{})) {
      report.push_back(static_cast<std::uint8_t>(byte));
    }
    exchange.send.push_back(report);
  }
  if (const auto id = table.Integer("answer_id", 0, 0xFF)) {
    exchange.answer_id = static_cast<std::uint8_t>(*id);
  }
  exchange.answer_bytes =
      table.RequiredInteger("answer_bytes", 1, zoom::kMaxHidReportBytes).value_or(1);
  exchange.count_at = table.Integer("count_at", 0, zoom::kMaxHidReportBytes - 1);
  if (exchange.count_at) exchange.count = table.RequiredInteger("count", 1, 0xFF).value_or(1);
  for (const TomlTable& field : table.Tables("field")) exchange.fields.push_back(ReadField(field));
  return exchange;
}

}  // namespace

std::optional<zoom::HidProfile> HidProfileFromText(std::string_view text, const std::string& file,
                                                   FaultList& faults) {
  if (RefuseWrongFile(text, file, kWantedZoomProfile, faults)) return std::nullopt;
  auto profile = ReadDocument(text, file, faults, [](TomlDocument& document) {
    const TomlTable root = document.Root();
    zoom::HidProfile read;
    root.RequiredInteger("schema", 1, 1);
    read.name = root.RequiredString("name").value_or("");
    read.source = root.RequiredString("source").value_or("");
    read.unconfirmed = root.String("unconfirmed").value_or("");
    read.vendor_id = root.RequiredInteger("vendor_id", 0, kLastId).value_or(0);
    read.product_id = root.RequiredInteger("product_id", 0, kLastId).value_or(0);
    read.silence_is_unchanged =
        root.OneOf<bool>("silence", {{"lost", false}, {"unchanged", true}}).value_or(false);
    if (!root.Has("exchange")) root.AddMissing("exchange", "at least one [[exchange]]");
    for (const TomlTable& table : root.Tables("exchange")) {
      read.exchanges.push_back(ReadExchange(table));
    }
    return read;
  });
  if (!profile) return std::nullopt;
  if (const auto fault = FaultOf(*profile)) {
    faults.Add({Fault::Severity::kFault, file, 1, "", *fault});
    return std::nullopt;
  }
  return profile;
}

}  // namespace plumbline::config
