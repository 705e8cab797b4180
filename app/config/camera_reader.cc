#include <fmt/format.h>

#include <algorithm>

#include "app/config/body_reader.h"
#include "app/config/camera_config.h"
#include "app/config/limits.h"
#include "app/config/named_files.h"
#include "app/config/plausibility.h"
#include "app/config/toml_reader.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/status/camera_status.h"

namespace plumbline {
namespace {

constexpr NumberRange kRate{0.01, 1000};
constexpr NumberRange kExposure{0.001, 60000, kSecondPerMs};
constexpr NumberRange kWhiteBalance{1000, 40000};
constexpr NumberRange kSquare{0.01, 10000, kMetrePerMm};
constexpr NumberRange kBoardPatience{1, 3600};
constexpr NumberRange kPixels{0.001, 100};
constexpr NumberRange kDistance{1, 1e6, kMetrePerMm};
constexpr NumberRange kPlaceSd{0.001, 100, kMetrePerMm};
constexpr int kLargestSide = 16384, kMostCounts = 1 << 24;

}  // namespace

std::optional<CameraName> CameraNameFromToml(const TomlTable& table, std::string_view key) {
  return table.OneOf<CameraName>(key, {{"side", CameraName::kSide},
                                       {"rear", CameraName::kRear},
                                       {"front", CameraName::kFront},
                                       {"top", CameraName::kTop}});
}

/// Keys of both kinds are read; those of the other one are of no use, and no fault.
CameraConfig CameraFromToml(const TomlTable& table, const NamedFiles& files) {
  using Word = std::string_view;
  CameraConfig camera;
  camera.name = CameraNameFromToml(table, "name").value_or(CameraName::kNone);
  const auto kind = table.OneOf<Word>("kind", {{"v4l2", "v4l2"}, {"recorded", "recorded"}});
  if (kind) camera.kind = *kind;
  const bool known = kind || !table.Has("kind");
  const auto text = [&](const char* key, const char* of_kind) {
    const bool required = known && camera.kind == of_kind;
    return (required ? table.RequiredString(key) : table.String(key)).value_or("");
  };
  const auto rate_hz = table.Number("rate_hz", kRate);

  RecordedCameraOptions& recorded = camera.connection.recorded;
  recorded.path = text("path", "recorded");
  if (!recorded.path.empty()) recorded.path = files.Beside(recorded.path);
  recorded.rate_hz = rate_hz.value_or(recorded.rate_hz);
  recorded.repeat = table.Bool("repeat").value_or(recorded.repeat);
  recorded.serial = table.String("serial").value_or("");
  recorded.mode = table.String("mode").value_or("");

  V4l2CameraOptions& v4l2 = camera.connection.v4l2;
  v4l2.device = text("device", "v4l2");
  v4l2.mode.rate_hz = rate_hz.value_or(v4l2.mode.rate_hz);
  v4l2.mode.size.width = table.Integer("width_px", 1, kLargestSide).value_or(0);
  v4l2.mode.size.height = table.Integer("height_px", 1, kLargestSide).value_or(0);
  if ((v4l2.mode.size.width == 0) != (v4l2.mode.size.height == 0)) {
    table.AddFault("width_px", "and height_px must stand together, or neither");
  }
  CameraSettings& settings = v4l2.settings;
  settings.exposure_s = table.Number("exposure_ms", kExposure);
  settings.gain_counts = table.Integer("gain_counts", 0, kMostCounts);
  settings.white_balance_K = table.Number("white_balance_K", kWhiteBalance);
  settings.focus_counts = table.Integer("focus_counts", 0, kMostCounts);
  return camera;
}

namespace {

/// What is printed on it. A number is judged against the others only where all could be read.
Board PrintFromToml(const TomlTable& table) {
  Board board;
  const auto kind = table.OneOf<BoardKind>("kind", {{"chessboard", BoardKind::kChessboard},
                                                    {"charuco", BoardKind::kCharuco},
                                                    {"circles", BoardKind::kCircles},
                                                    {"acircles", BoardKind::kAsymmetricCircles}});
  const auto columns = table.Integer("columns", 3, 100), rows = table.Integer("rows", 3, 100);
  const auto square_m = table.Number("square_mm", kSquare);
  const auto mark_m = table.Number("mark_mm", kSquare);
  board.kind = kind.value_or(board.kind);
  board.columns = columns.value_or(board.columns);
  board.rows = rows.value_or(board.rows);
  board.square_m = square_m.value_or(board.square_m);
  board.mark_m = mark_m.value_or(board.mark_m);
  board.family = table.String("family").value_or(board.family);
  const auto faulty = [&](const char* key, bool read) { return table.Has(key) && !read; };
  if (faulty("kind", kind.has_value()) || faulty("columns", columns.has_value()) ||
      faulty("rows", rows.has_value()) || faulty("square_mm", square_m.has_value()) ||
      faulty("mark_mm", mark_m.has_value())) {
    return board;
  }
  const auto fault = FaultOf(board);
  if (fault && table.Has(fault->key)) table.AddFault(fault->key, "is no board: " + fault->words);
  if (fault && !table.Has(fault->key)) table.AddMissing(fault->key, fault->words);
  return board;
}

}  // namespace

BoardConfig BoardFromToml(const TomlTable& table) {
  BoardConfig board;
  board.board = PrintFromToml(table);
  board.views = table.Integer("views", 8, 200).value_or(board.views);
  board.most_views =
      table.Integer("most_views", 8, 400).value_or(std::max(board.most_views, board.views));
  if (board.most_views < board.views) table.AddFault("most_views", "is below views");
  board.patience_s = table.Number("patience_s", kBoardPatience).value_or(board.patience_s);
  board.acceptable_px = table.Number("acceptable_px", kPixels).value_or(board.acceptable_px);
  board.distance_m = table.Number("distance_mm", kDistance);
  board.by_itself = table.Bool("by_itself").value_or(board.by_itself);
  return board;
}

namespace {

void CheckBody(const TomlTable& table, const char* key, const std::string& name,
               const TagDatabase& database, std::size_t least_tags) {
  for (const Body& body : database.bodies) {
    if (body.name != name) continue;
    if (body.tags.size() >= least_tags) return;
    table.AddFault(
        key, fmt::format("\"{}\" has {} tags; {} are needed", name, body.tags.size(), least_tags));
    return;
  }
  table.AddFault(key, fmt::format("\"{}\" is no [[body]] of the tags' file", name));
}

}  // namespace

TagsConfig TagsFromToml(const TomlTable& table, const NamedFiles& files, FaultList& faults) {
  TagsConfig tags;
  bool known = false;
  if (const auto file = files.Read(table, "file", "")) {
    tags.file = file->first;
    tags.text = file->second;
    if (auto database = TagDatabaseFromText(file->second, file->first, faults)) {
      tags.database = std::move(*database);
      known = true;
    }
  }
  tags.family = table.String("family").value_or(tags.family);
  tags.threshold = table.Integer("threshold", 0, 255);
  tags.cell = table.String("cell").value_or(tags.cell);
  tags.X_WK.p = table.Vector3("cell_xyz_mm", kPlaceRange).value_or(Vec3::Zero());
  tags.X_WK.R =
      RotationFromRollPitchYaw(table.Vector3("cell_rpy_deg", kTurnRange).value_or(Vec3::Zero()));
  WarnOfRadians(table, "cell_rpy_deg");
  tags.place_sd_m = table.Number("place_sd_mm", kPlaceSd).value_or(tags.place_sd_m);
  for (Body& body : tags.database.bodies) {
    if (body.place_sd_m) continue;
    body.place_sd_m = body.name == tags.cell ? tags.place_sd_m : kPlaceSdOnOnePlate_m;
  }
  tags.tool = table.String("tool").value_or("");
  if (tags.tool.empty()) {
    table.Ignore({"tip_mm"});
  } else {
    tags.tip_T = table.RequiredVector3("tip_mm", kPlaceRange).value_or(Vec3::Zero());
  }
  if (!known) return tags;
  CheckBody(table, "cell", tags.cell, tags.database, 2);
  if (!tags.tool.empty()) CheckBody(table, "tool", tags.tool, tags.database, 1);
  if (tags.database.bodies.size() > CameraStatus::kMostBodies) {
    table.AddWarning("file", fmt::format("has {} bodies; the PLC is told of the first {}",
                                         tags.database.bodies.size(), CameraStatus::kMostBodies));
  }
  return tags;
}

}  // namespace plumbline
