// Configuration table, continued: [zoom]. The keys of a sensor kind are declared by the kind.
#include "app/base/config/zoom_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <variant>

#include "app/base/config/daemon_settings.h"
#include "app/base/config/limits.h"

namespace plumbline::config {
namespace {

const zoom::ZoomOption* FindOption(const zoom::ZoomKind& kind, std::string_view key) {
  for (const zoom::ZoomOption& option : kind.options) {
    if (option.key == key) return &option;
  }
  return nullptr;
}

/// @param required  if it is a text: unless a value is already stored
void ListOption(Settings& keys, const zoom::ZoomOption& option, bool required,
                zoom::ZoomConnection& connection) {
  const NumberRange range{option.min, option.max, option.to_si};
  SettingDoc doc{.description = option.description,
                 .example = option.example,
                 .default_text = option.default_text,
                 .required = required};
  if (std::holds_alternative<zoom::FileOption>(option.value)) {
    keys.Document(option.key, "text", doc);
  } else if (const auto* text = std::get_if<zoom::TextOption>(&option.value)) {
    std::string& value = (*text)(connection);
    doc.required = required && value.empty();
    keys.Add(option.key, value, doc);
  } else if (const auto* number = std::get_if<zoom::NumberOption>(&option.value)) {
    keys.Add(option.key, (*number)(connection), range, doc);
  } else if (const auto* integer = std::get_if<zoom::IntegerOption>(&option.value)) {
    keys.Add(option.key, (*integer)(connection), range, doc);
  } else if (const auto* flag = std::get_if<zoom::FlagOption>(&option.value)) {
    keys.Add(option.key, (*flag)(connection), doc);
  }
  const std::string fault = option.fault == nullptr ? "" : option.fault(connection);
  if (!fault.empty()) keys.AddFault(option.key, fault);
}

/// Stores the device of the camera in the options of the kind that default to it.
void UseCameraDevice(const zoom::ZoomKind& kind, const std::string& camera,
                     zoom::ZoomConnection& connection) {
  for (const zoom::ZoomOption& option : kind.options) {
    const auto* const text = std::get_if<zoom::TextOption>(&option.value);
    if (option.camera_device && text != nullptr) (*text)(connection) = camera;
  }
}

/// The default reading periods: the usual one, then the others, each with its kind.
std::string PeriodText(std::span<const zoom::ZoomKind* const> kinds) {
  std::string text = fmt::format("{:g}", zoom::kQuickZoomPeriod_s / kSecondPerMs);
  for (const zoom::ZoomKind* kind : kinds) {
    if (kind->period_s == zoom::kQuickZoomPeriod_s) continue;
    text += fmt::format("; {:g} for \"{}\"", kind->period_s / kSecondPerMs, kind->name);
  }
  return text;
}

void ListKeys(Settings& keys, lens::ZoomSupervisorSettings& zoom) {
  keys.Add("zoom_band_counts", zoom.zoom_band_counts, {0, 10000},
           {"dead band: smaller zoom changes are ignored"});
  keys.Add("focus_band_counts", zoom.focus_band_counts, {0, 10000},
           {"dead band: smaller focus changes are ignored"});
  keys.Add("settle_ms", zoom.settle_s, {0, 60000, kSecondPerMs},
           {"time the lens must have been at rest before it is used"});
  keys.Add("lost_after_ms", zoom.lost_after_s, {100, 600000, kSecondPerMs},
           {"without a reading for this time the sensor counts as lost"});
  keys.Add(
      "verify_patience_s", zoom.verify_patience_s, {0.1, 600},
      {"time that the tags may take to verify the lens before the calibration board is requested"});
}

}  // namespace

/// A key is documented once, as its first kind declares it, and stored where the selected kind
/// declares it. A key of another kind is checked, but has no effect.
void ListKindKeys(Settings& keys, std::span<const zoom::ZoomKind* const> kinds,
                  std::string_view selected_kind, zoom::ZoomConnection& connection) {
  const zoom::ZoomKind* selected = nullptr;
  for (const zoom::ZoomKind* kind : kinds) {
    if (kind->name == selected_kind) selected = kind;
  }
  std::vector<std::string_view> listed;
  for (const zoom::ZoomKind* kind : kinds) {
    for (const zoom::ZoomOption& declared : kind->options) {
      if (std::find(listed.begin(), listed.end(), declared.key) != listed.end()) continue;
      listed.push_back(declared.key);
      const zoom::ZoomOption* const own =
          selected == nullptr ? nullptr : FindOption(*selected, declared.key);
      ListOption(keys, own == nullptr ? declared : *own, own != nullptr && own->required,
                 connection);
    }
  }
}

void ListKeys(Settings& keys, ZoomConfig& zoom, const std::string& camera) {
  std::vector<Choice<std::string>> kinds;
  for (const zoom::ZoomKind* kind : zoom::ZoomKinds())
    kinds.push_back({kind->name, std::string(kind->name)});
  kinds.push_back({"none", ""});
  keys.Choose("kind", zoom.kind, kinds, Required("how the zoom is sensed", "\"visca\""));
  const zoom::ZoomKind* const kind = zoom::FindZoomKind(zoom.kind);
  if (kind != nullptr) UseCameraDevice(*kind, camera, zoom.connection);
  ListKindKeys(keys, zoom::ZoomKinds(), zoom.kind, zoom.connection);
  zoom.period_s = kind == nullptr ? zoom::kZoomPeriod_s : kind->period_s;
  static const std::string period_text = PeriodText(zoom::ZoomKinds());
  keys.Add("period_ms", zoom.period_s, {10, 1000, kSecondPerMs},
           {.description = "polling period", .default_text = period_text});
  ListKeys(keys, zoom.supervision);
}

}  // namespace plumbline::config
