// Which cameras there are, and whether they stay out of each other's way.
#include <fmt/format.h>

#include <algorithm>

#include "app/config/camera_config.h"
#include "app/config/named_files.h"
#include "app/config/toml_reader.h"

namespace plumbline {
namespace {

constexpr const char* kSomeNames = "\"side\", \"rear\", \"front\" or \"top\"";

/// What selects the camera: lenses are kept by the serial number that comes of it.
struct Selected {
  const char* key;
  std::string by;
};

Selected SelectedBy(const CameraConfig& camera) {
  if (camera.kind != "recorded") return {"device", camera.connection.v4l2.device};
  const std::string& serial = camera.connection.recorded.serial;
  return {"serial", serial.empty() ? "recorded" : serial};
}

/// The one sensor that answers for the zoom; empty: nothing that two could want.
std::string SensorOf(const ZoomConfig& zoom) {
  const ZoomKind* const kind = FindZoomKind(zoom.kind);
  return kind == nullptr ? "" : kind->identity(zoom.connection);
}

/// @param former  an earlier camera than `camera`, whose table this is
void CheckApart(const TomlTable& table, const CameraConfig& camera, const CameraConfig& former) {
  if (camera.name != CameraName::kNone && camera.name == former.name) {
    table.AddFault("name",
                   fmt::format("is the name of two cameras; give each its own: {}", kSomeNames));
  }
  const Selected own = SelectedBy(camera), other = SelectedBy(former);
  if (!own.by.empty() && own.by == other.by && std::string_view(own.key) == "device") {
    table.AddFault("device",
                   "is the device of two cameras; `plumbline cameras` shows the name of each, with "
                   "its port where two have one serial number");
  } else if (!own.by.empty() && own.by == other.by) {
    table.AddFault("serial",
                   "is the serial number of two cameras (of a recording that states none: "
                   "\"recorded\"), and lenses are kept by it; give each its own");
  }
  if (const std::string sensor = SensorOf(camera.zoom);
      !sensor.empty() && sensor == SensorOf(former.zoom)) {
    table.AddFault("zoom",
                   fmt::format("is sensed at {}, as that of another camera is; each needs "
                               "a sensor of its own{}",
                               sensor, camera.zoom.kind == "hid" ? ", told by serial" : ""));
  }
}

/// @param beside  [zoom] of a single camera
std::vector<CameraConfig> CamerasFromToml(const std::vector<TomlTable>& tables,
                                          const std::optional<TomlTable>& beside,
                                          const NamedFiles& files, FaultList& faults) {
  std::vector<CameraConfig> cameras;
  for (const TomlTable& table : tables) {
    CameraConfig camera = CameraFromToml(table, files);
    auto zoom = table.Table("zoom");
    if (zoom && beside) table.AddFault("zoom", "stands beside [zoom]; keep one of them");
    if (beside) zoom = beside;
    if (zoom) {
      camera.zoom = ZoomFromToml(*zoom, files, camera.connection.v4l2.device, faults);
    }
    if (tables.size() > 1 && !table.Has("name")) table.AddMissing("name", kSomeNames);
    if (cameras.size() == kMostCameras) {
      table.AddFault("", fmt::format("is one camera too many: there may be {}", kMostCameras));
    }
    for (const CameraConfig& former : cameras) CheckApart(table, camera, former);
    cameras.push_back(std::move(camera));
  }
  return cameras;
}

}  // namespace

Body CellMarksOf(const TagsConfig& tags) {
  for (const Body& body : tags.database.bodies) {
    if (body.name == tags.cell) return body;
  }
  return {};
}

VisionConfig VisionFromToml(const TomlTable& root, const NamedFiles& files, FaultList& faults) {
  VisionConfig vision;
  const std::vector<TomlTable> tables = root.TableOrTables("camera");
  if (tables.empty()) {
    for (const char* key : {"zoom", "board", "tags"}) {
      if (!root.Has(key)) continue;
      root.AddFault(key, "has no meaning without [camera]");
      root.Ignore({key});
    }
    return vision;
  }
  std::optional<TomlTable> zoom;
  if (tables.size() == 1) {
    zoom = root.Table("zoom");
  } else if (root.Has("zoom")) {
    root.AddFault("zoom", "is of one camera: write [camera.zoom] below each [[camera]]");
    root.Ignore({"zoom"});
  }
  vision.cameras = CamerasFromToml(tables, zoom, files, faults);
  if (const auto board = root.Table("board")) vision.board = BoardFromToml(*board);
  if (const auto tags = root.RequiredTable("tags")) {
    vision.tags = TagsFromToml(*tags, files, faults);
    const Board& board = vision.board.board;
    if (board.kind == BoardKind::kCharuco && board.family == vision.tags.family) {
      tags->AddWarning("family",
                       "is that of the board too: its tags may be taken for the cell's; "
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

}  // namespace plumbline
