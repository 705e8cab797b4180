#include "app/vision/camera/camera_devices.h"

#include <fmt/format.h>

#include "drivers/files/text_file.h"

namespace plumbline::vision {
namespace {

Result<std::unique_ptr<zoom::ZoomSensor>> ZoomFrom(const config::ZoomConfig& config) {
  if (config.kind.empty()) {  // a lens without zoom is always at 0
    zoom::ZoomRow still;
    still.reading.zoom_counts = 0;
    return zoom::ReplayZoom::Create({still}, MonotonicSeconds);
  }
  zoom::ZoomConnection connection = config.connection;
  if (config.kind == "replay") {
    const Result<std::string> text = files::ReadFileUpTo(files::kTableSize, config.replay_file);
    if (!text) return Error{fmt::format("{}: {}", config.replay_file, text.error())};
    auto rows = zoom::ZoomRowsFromCsv(*text);
    if (!rows) return Error{fmt::format("{}: {}", config.replay_file, rows.error())};
    connection.replay = std::move(rows).value();
  }
  const zoom::ZoomKind* const kind = zoom::FindZoomKind(config.kind);
  if (kind == nullptr) return Error{fmt::format("unknown zoom sensor \"{}\"", config.kind)};
  return kind->make(connection);
}

}  // namespace

Result<CameraDevices> MakeCameraDevices(const config::CameraConfig& config,
                                        const config::TagsConfig& tags) {
  CameraDevices devices;
  auto camera = camera::MakeCamera(config.kind, config.connection);
  if (!camera) return Error{fmt::format("[camera]: {}", camera.error())};
  devices.camera = std::move(camera).value();
  auto zoom = ZoomFrom(config.zoom);
  if (!zoom) return Error{fmt::format("[zoom]: {}", zoom.error())};
  devices.zoom = std::move(zoom).value();
  auto family = target::TagFamilyOfName(tags.family);
  if (!family) return Error{fmt::format("tags.family: {}", family.error())};
  TrackerSettings settings;
  settings.detector.threshold = tags.threshold;
  devices.tracker = std::make_unique<Tracker>(std::move(family).value(), tags.database, settings);
  return devices;
}

}  // namespace plumbline::vision
