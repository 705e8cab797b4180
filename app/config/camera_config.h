// [camera] or [[camera]], [zoom], [board] and [tags] of plumbline.toml.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/config/fault.h"
#include "app/lens/board.h"
#include "app/tracking/bodies.h"
#include "drivers/camera/registry.h"
#include "drivers/zoom/registry.h"
#include "firmware-like/lens/zoom_supervisor.h"
#include "firmware-like/status/camera_status.h"

namespace plumbline {

class NamedFiles;
class TomlTable;

struct ZoomConfig {
  std::string kind;           ///< of ZoomKinds(); empty: a lens without zoom
  ZoomConnection connection;  ///< its replay's rows are still in replay_file
  std::string replay_file;
  double period_s = kZoomPeriod_s;  ///< from one reading to the next
  ZoomSupervisionSettings supervision;
};

struct BoardConfig {
  Board board;
  int views = 20, most_views = 60;
  double patience_s = 180;
  double acceptable_px = 0.5;        ///< uncertainty of the projection, one deviation
  std::optional<double> distance_m;  ///< where it is judged; nothing: at infinity
  bool by_itself = true;  ///< a board that comes into view while it is asked for starts the capture
};

struct TagsConfig {
  std::string file, text;
  std::string family = "36h11";
  std::optional<int> threshold;  ///< 0..255; nothing: by the light around each place
  TagDatabase database;
  std::string cell = "cell";  ///< the body of fixed marks
  Pose X_WK;                  ///< where that body is in the measurement frame
  double place_sd_m = 2e-4;   ///< of a fixed mark's declared place, an axis
  std::string tool;           ///< the body that carries the tip; empty: none
  Vec3 tip_T = Vec3::Zero();  ///< on that body
};

struct CameraConfig {
  CameraName name = CameraName::kNone;  ///< told apart by it; of two cameras each has one
  std::string kind = "v4l2";            ///< of CameraKinds()
  CameraConnection connection;
  ZoomConfig zoom;
};

/// The cameras, and what they share: one cell, one set of bodies, one board.
struct VisionConfig {
  std::string text;  ///< of all its tables and the tags' file: what a reload compares
  std::vector<CameraConfig> cameras;  ///< at most kMostCameras; empty: none
  BoardConfig board;
  TagsConfig tags;
};

/// The body of the cell's fixed marks; an empty one where there is none of that name.
Body CellMarksOf(const TagsConfig& tags);

/// [camera] with its zoom in [zoom] or [camera.zoom], or each [[camera]] with its [camera.zoom].
/// [zoom], [board] and [tags] without a camera are faults, and cameras that take each other's
/// name, device, serial number or zoom sensor.
VisionConfig VisionFromToml(const TomlTable& root, const NamedFiles& files, FaultList& faults);

/// Keys of both kinds are checked; those of the other one are of no use, and no fault. Its zoom is
/// not read.
CameraConfig CameraFromToml(const TomlTable& table, const NamedFiles& files);
BoardConfig BoardFromToml(const TomlTable& table);
TagsConfig TagsFromToml(const TomlTable& table, const NamedFiles& files, FaultList& faults);
/// @param camera  whose device serves where the zoom is a control of it
ZoomConfig ZoomFromToml(const TomlTable& table, const NamedFiles& files, const std::string& camera,
                        FaultList& faults);

}  // namespace plumbline
