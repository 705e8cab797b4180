#include <algorithm>

#include "app/base/config/daemon_settings.h"

namespace plumbline::config {

OverlayConfig OverlayFromToml(const TomlTable& table, const NamedFiles& files,
                              const VisionConfig& vision) {
  OverlayConfig overlay;
  ReadKeys(table, overlay, &files);
  if (!overlay.device.empty() && overlay.device.front() != '/') {
    table.AddFault("device", "is not an absolute path such as /dev/dri/card0 or /dev/fb0");
  }
  if (table.Has("width_px") != table.Has("height_px")) {
    table.AddFault("width_px", "and height_px must be given together");
  }
  const bool known = std::any_of(vision.cameras.begin(), vision.cameras.end(),
                                 [&](const auto& one) { return one.name == overlay.camera; });
  if (overlay.camera && !known) {
    table.AddFault("camera",
                   "is not the name of any [[camera]]; give a camera this name, or write \"both\"");
  }
  return overlay;
}

}  // namespace plumbline::config
