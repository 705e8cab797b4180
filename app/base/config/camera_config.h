// Vision part of plumbline.toml: [camera] or [[camera]], [zoom], [board] and [tags].
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/base/config/fault.h"
#include "app/base/target/board.h"
#include "app/base/target/declared_facts.h"
#include "app/base/target/tags.h"
#include "drivers/camera/registry.h"
#include "drivers/zoom/registry.h"
#include "firmware-like/lens/zoom_supervisor.h"
#include "firmware-like/status/camera_status.h"

namespace plumbline::config {

class NamedFiles;
class TomlTable;

struct ZoomConfig {
  std::string kind;  ///< one of ZoomKinds(); empty: a lens without zoom
  zoom::ZoomConnection
      connection;  ///< for kind "replay", without the rows of replay_file, which are read later
  std::string replay_file;
  double period_s = zoom::kZoomPeriod_s;  ///< polling period
  lens::ZoomSupervisorSettings supervision;
};

struct BoardConfig {
  target::Board board;
  int views = 6, max_views = 60;
  double patience_s = 180;
  double acceptable_px = 0.5;        ///< largest standard deviation of the projection
  std::optional<double> distance_m;  ///< distance at which it is evaluated; infinity if nullopt
  bool by_itself = true;  ///< a requested calibration starts when the board comes into view
};

struct TagsConfig {
  std::string file, text;
  std::string family = "36h11";
  std::optional<int> threshold;  ///< grey level 0..255; adaptive if nullopt
  target::TagDatabase database;
  std::string cell = "cell";  ///< the body with the reference tags
  Pose X_WK;                  ///< pose of that body in the measurement frame
  double place_sd_m = 2e-4;   ///< standard deviation of a reference tag's position, per axis
  std::string tool;           ///< the body that carries the tool tip; empty: none
  Vec3 tip_T = Vec3::Zero();  ///< tip in the frame of that body [m]
};

struct CameraConfig {
  status::CameraName name = status::CameraName::kNone;  ///< set if there are two cameras
  std::string kind = "v4l2";                            ///< of drivers/camera/registry.h
  camera::CameraConnection connection;
  ZoomConfig zoom;
  std::vector<std::string> required_for;  ///< what its lens must be valid for: kRequiredForPoints
  bool RequiredForPoints() const { return !required_for.empty(); }
  target::DeclaredFacts declared;  ///< on which the calibration of its lens may rely
};

/// The only entry of `required_for`.
inline constexpr const char* kRequiredForPoints = "points";

/// The cameras and what they share: one cell, one set of bodies, one board.
struct VisionConfig {
  std::string text;  ///< its tables and the tag file as text; a reload compares it to find changes
  std::vector<CameraConfig> cameras;  ///< at most kMaxCameras; empty: none
  BoardConfig board;
  TagsConfig tags;
};

/// The body with the cell's reference tags; an empty body if the file has none of that name.
target::Body CellReferenceTags(const TagsConfig& tags);

/// Reads [camera] with its zoom in [zoom] or [camera.zoom], or each [[camera]] with its
/// [camera.zoom]. Faults: [zoom], [board] or [tags] without a camera; two cameras that share a
/// name, device, serial number or zoom sensor.
VisionConfig VisionFromToml(const TomlTable& root, const NamedFiles& files, FaultList& faults);

/// Checks the keys of all kinds; a key of another kind is ignored, not a fault. Does not read
/// the zoom.
CameraConfig CameraFromToml(const TomlTable& table, const NamedFiles& files);
BoardConfig BoardFromToml(const TomlTable& table);
TagsConfig TagsFromToml(const TomlTable& table, const NamedFiles& files, FaultList& faults);
/// @param camera  device of the camera: default for a zoom that is one of its V4L2 controls
ZoomConfig ZoomFromToml(const TomlTable& table, const NamedFiles& files, const std::string& camera,
                        FaultList& faults);

}  // namespace plumbline::config
