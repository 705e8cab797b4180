#include <fmt/format.h>

#include "app/base/config/daemon_settings.h"
#include "app/base/config/limits.h"
#include "app/base/config/zoom_profile_reader.h"

namespace plumbline::config {

ZoomConfig ZoomFromToml(const TomlTable& table, const NamedFiles& files, const std::string& camera,
                        FaultList& faults) {
  ZoomConfig zoom;
  Settings keys(table);
  ListKeys(keys, zoom, camera);
  if (const auto file = files.ReadIf(zoom.kind == "hid", table, "profile", "profiles/zoom")) {
    if (auto profile = HidProfileFromText(file->second, file->first, faults)) {
      zoom.connection.hid.profile = std::move(*profile);
    }
  }
  if (const auto file = files.ReadIf(zoom.kind == "replay", table, "file", "")) {
    zoom.replay_file = file->first;
  }
  if (zoom.supervision.lost_after_s < 2 * zoom.period_s) {
    table.AddFault(
        "lost_after_ms",
        fmt::format("is less than two polling periods of {:g} ms: the sensor would always be lost",
                    zoom.period_s / kSecondPerMs));
  }
  return zoom;
}

}  // namespace plumbline::config
