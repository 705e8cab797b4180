// Reader of the cameras and their shared tables; checks that two cameras do not share a device.
#include <fmt/format.h>

#include <algorithm>

#include "app/base/config/camera_config.h"
#include "app/base/config/named_files.h"
#include "app/base/config/toml_reader.h"

namespace plumbline::config {
namespace {

constexpr const char* kCameraNameList = "\"side\", \"rear\", \"front\" or \"top\"";

/// The key that selects the camera and its value; lenses are stored under the resulting serial
/// number.
struct Selector {
  const char* key;
  std::string value;
};

Selector SelectorOf(const CameraConfig& camera) {
  if (camera.kind != "recorded") return {"device", camera.connection.v4l2.device};
  const std::string& serial = camera.connection.recorded.serial;
  return {"serial", serial.empty() ? "recorded" : serial};
}

/// Identity of the zoom sensor; empty if it cannot conflict with another camera's.
std::string SensorOf(const ZoomConfig& zoom) {
  const zoom::ZoomKind* const kind = zoom::FindZoomKind(zoom.kind);
  return kind == nullptr ? "" : kind->identity(zoom.connection);
}

/// Adds faults if two cameras share a name, device, serial number or zoom sensor.
/// @param table    the table of `camera`
/// @param earlier  a camera listed before it
void CheckDistinct(const TomlTable& table, const CameraConfig& camera,
                   const CameraConfig& earlier) {
  if (camera.name != status::CameraName::kNone && camera.name == earlier.name) {
    table.AddFault("name",
                   fmt::format("is used for two cameras; give each its own: {}", kCameraNameList));
  }
  const std::string& serial = camera.connection.dv.serial;
  if (camera.kind == "dv" && earlier.kind == "dv" && !serial.empty() &&
      serial == earlier.connection.dv.serial) {
    table.AddFault("serial",
                   "is used for two cameras, but lenses are stored under it; give each its own");
  }
  const Selector own = SelectorOf(camera), other = SelectorOf(earlier);
  if (!own.value.empty() && own.value == other.value && std::string_view(own.key) == "device") {
    table.AddFault("device",
                   "is used for two cameras; `plumbline cameras` prints the name of each, with its "
                   "port if two have the same serial number");
  } else if (!own.value.empty() && own.value == other.value) {
    table.AddFault("serial",
                   "is used for two cameras (\"recorded\" if a recording states none), but lenses "
                   "are stored by serial number; give each camera its own");
  }
  if (const std::string sensor = SensorOf(camera.zoom);
      !sensor.empty() && sensor == SensorOf(earlier.zoom)) {
    table.AddFault(
        "zoom", fmt::format("uses the same sensor as another camera, {}; each camera needs its "
                            "own{}",
                            sensor, camera.zoom.kind == "hid" ? ", distinguished by serial" : ""));
  }
}

/// @param single_zoom  [zoom] of a single camera
std::vector<CameraConfig> CamerasFromToml(const std::vector<TomlTable>& tables,
                                          const std::optional<TomlTable>& single_zoom,
                                          const NamedFiles& files, FaultList& faults) {
  std::vector<CameraConfig> cameras;
  for (const TomlTable& table : tables) {
    CameraConfig camera = CameraFromToml(table, files);
    auto zoom = table.Table("zoom");
    if (zoom && single_zoom)
      table.AddFault("zoom", "is given in addition to [zoom]; keep only one");
    if (single_zoom) zoom = single_zoom;
    if (zoom) {
      camera.zoom = ZoomFromToml(*zoom, files, camera.connection.v4l2.device, faults);
    }
    if (tables.size() > 1 && !table.Has("name")) table.AddMissing("name", kCameraNameList);
    if (cameras.size() == model::kMaxCameras) {
      table.AddFault("",
                     fmt::format("is one camera too many; at most {} cameras", model::kMaxCameras));
    }
    for (const CameraConfig& earlier : cameras) CheckDistinct(table, camera, earlier);
    cameras.push_back(std::move(camera));
  }
  return cameras;
}

}  // namespace

target::Body CellReferenceTags(const TagsConfig& tags) {
  for (const target::Body& body : tags.database.bodies) {
    if (body.name == tags.cell) return body;
  }
  return {};
}

VisionConfig VisionFromToml(const TomlTable& root, const NamedFiles& files, FaultList& faults) {
  VisionConfig vision;
  const std::vector<TomlTable> tables = root.TableOrTables("camera");
  if (tables.empty()) {
    for (const char* key : {"zoom", "board", "tags"}) {
      root.Ignore({key});
      if (root.Has(key)) root.AddFault(key, "requires a [camera] with a key, such as kind");
    }
    return vision;
  }
  std::optional<TomlTable> zoom;
  if (tables.size() == 1) {
    zoom = root.Table("zoom");
  } else {
    if (root.Has("zoom")) {
      root.AddFault(
          "zoom", "is allowed for a single camera only; write [camera.zoom] below each [[camera]]");
    }
    root.Ignore({"zoom"});
  }
  vision.cameras = CamerasFromToml(tables, zoom, files, faults);
  if (const auto board = root.Table("board")) vision.board = BoardFromToml(*board);
  if (const auto tags = root.RequiredTable("tags")) {
    vision.tags = TagsFromToml(*tags, files, faults);
    const target::Board& board = vision.board.board;
    if (board.kind == target::BoardKind::kCharuco && board.family == vision.tags.family) {
      tags->AddWarning(
          "family",
          "is also the family of the board, whose tags may be mistaken for the cell's; "
          "print the board with another family");
    }
  }
  vision.text = vision.tags.text;
  for (const TomlTable& table : tables) vision.text += table.Text() + "\n";
  for (const auto& part : {zoom, root.Table("board"), root.Table("tags")}) {
    if (part) vision.text += part->Text() + "\n";
  }
  return vision;
}

}  // namespace plumbline::config
