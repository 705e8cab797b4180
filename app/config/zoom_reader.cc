#include <fmt/format.h>

#include "app/config/camera_config.h"
#include "app/config/limits.h"
#include "app/config/named_files.h"
#include "app/config/toml_reader.h"
#include "app/config/zoom_profile_reader.h"

namespace plumbline {
namespace {

constexpr NumberRange kPeriod{10, 1000, kSecondPerMs};
constexpr NumberRange kZoomTimeout{10, 10000, kSecondPerMs};
constexpr NumberRange kDebounce{0, 1000, kSecondPerMs};
constexpr NumberRange kSettle{0, 60000, kSecondPerMs};
constexpr NumberRange kLostAfter{100, 600000, kSecondPerMs};
constexpr NumberRange kVerifyPatience{0.1, 600};
constexpr int kMostCounts = 1 << 24;
/// A report of HID or an event costs nothing; a serial line at 9600 baud is busy for 20 ms.
constexpr double kQuickPeriod_s = 0.05;

void Visca(const TomlTable& table, const std::string& device, ViscaOptions& visca) {
  visca.device = device;
  visca.baud = table.Integer("baud", 9600, 38400).value_or(visca.baud);
  if (visca.baud != 9600 && visca.baud != 38400) table.AddFault("baud", "is not 9600 or 38400");
  visca.address = table.Integer("address", 1, 7).value_or(visca.address);
  visca.timeout_s = table.Number("timeout_ms", kZoomTimeout).value_or(visca.timeout_s);
  visca.optical_max_counts =
      table.Integer("optical_max_counts", 1, kMostCounts).value_or(visca.optical_max_counts);
}

void Hid(const TomlTable& table, bool chosen, const NamedFiles& files, HidOptions& hid,
         FaultList& faults) {
  hid.serial = table.String("serial").value_or("");
  hid.timeout_s = table.Number("timeout_ms", kZoomTimeout).value_or(hid.timeout_s);
  if (!chosen) {
    static_cast<void>(table.String("profile"));
    return;
  }
  if (const auto file = files.Read(table, "profile", "profiles/zoom")) {
    if (auto profile = HidProfileFromText(file->second, file->first, faults)) {
      hid.profile = std::move(*profile);
    }
  }
}

void Gpio(const TomlTable& table, bool chosen, GpioOptions& gpio) {
  gpio.chip = (chosen ? table.RequiredString("chip") : table.String("chip")).value_or("");
  gpio.line = (chosen ? table.RequiredInteger("line", 0, 1023) : table.Integer("line", 0, 1023))
                  .value_or(0);
  gpio.active_low = table.Bool("active_low").value_or(gpio.active_low);
  gpio.debounce_s = table.Number("debounce_ms", kDebounce).value_or(gpio.debounce_s);
}

}  // namespace

/// Keys of all kinds are read; those of another one are of no use, and no fault.
ZoomConfig ZoomFromToml(const TomlTable& table, const NamedFiles& files, const std::string& camera,
                        FaultList& faults) {
  using Word = std::string_view;
  ZoomConfig zoom;
  const auto kind = table.RequiredOneOf<Word>("kind", {{"visca", "visca"},
                                                       {"hid", "hid"},
                                                       {"v4l2", "v4l2"},
                                                       {"gpio", "gpio"},
                                                       {"replay", "replay"},
                                                       {"none", "none"}});
  zoom.kind = kind && *kind != "none" ? std::string(*kind) : "";
  ZoomConnection& connection = zoom.connection;
  const bool of_camera = zoom.kind == "v4l2" && !camera.empty();
  const bool device_needed = zoom.kind == "visca" || (zoom.kind == "v4l2" && !of_camera);
  const std::string device =
      (device_needed ? table.RequiredString("device") : table.String("device"))
          .value_or(of_camera ? camera : "");
  Visca(table, device, connection.visca);
  Hid(table, zoom.kind == "hid", files, connection.hid, faults);
  Gpio(table, zoom.kind == "gpio", connection.gpio);
  connection.v4l2 = {device, kQuickPeriod_s};
  if (zoom.kind == "replay") {
    if (const auto file = files.Read(table, "file", "")) zoom.replay_file = file->first;
  } else {
    static_cast<void>(table.String("file"));
  }
  zoom.period_s = zoom.kind == "visca" || zoom.kind.empty() ? kZoomPeriod_s : kQuickPeriod_s;
  zoom.period_s = table.Number("period_ms", kPeriod).value_or(zoom.period_s);
  ZoomSupervisionSettings& s = zoom.supervision;
  s.zoom_band_counts = table.Integer("zoom_band_counts", 0, 10000).value_or(s.zoom_band_counts);
  s.focus_band_counts = table.Integer("focus_band_counts", 0, 10000).value_or(s.focus_band_counts);
  s.settle_s = table.Number("settle_ms", kSettle).value_or(s.settle_s);
  s.lost_after_s = table.Number("lost_after_ms", kLostAfter).value_or(s.lost_after_s);
  s.verify_patience_s =
      table.Number("verify_patience_s", kVerifyPatience).value_or(s.verify_patience_s);
  if (s.lost_after_s < 2 * zoom.period_s) {
    table.AddFault(
        "lost_after_ms",
        fmt::format("is below two readings of {:g} ms, so that the sensor is always lost",
                    zoom.period_s / kSecondPerMs));
  }
  return zoom;
}

}  // namespace plumbline
