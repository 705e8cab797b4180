// Configuration table, continued: [camera], [board], [tags] and [overlay].
#include <algorithm>

#include "app/base/config/daemon_settings.h"
#include "app/base/config/limits.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/image/image_size.h"

namespace plumbline::config {
namespace {

constexpr double kMaxCounts = 1 << 24, kMaxSide_px = 16384, kPaPerMPa = 1e6;
constexpr NumberRange kSquare{0.01, 10000, kMetrePerMm};

/// @param none  word for "no particular camera"; empty: a name is required
std::vector<Choice<status::CameraName>> CameraNames(std::string_view none) {
  std::vector<Choice<status::CameraName>> names;
  for (std::size_t k = none.empty() ? 1 : 0; k < status::kCameraNames.size(); ++k) {
    names.push_back({k == 0 ? none : status::kCameraNames[k], static_cast<status::CameraName>(k)});
  }
  return names;
}

void ListSettingKeys(Settings& keys, camera::CameraSettings& settings) {
  keys.Add("exposure_ms", settings.exposure_s, {0.001, 60000, kSecondPerMs},
           {"fixed exposure time", "8.0", "the camera's current value"});
  keys.Add("gain_counts", settings.gain_counts, {0, kMaxCounts},
           {"fixed gain, in units of the camera", "100", "the camera's current value"});
  keys.Add("white_balance_K", settings.white_balance_K, {1000, 40000},
           {"fixed white balance", "5000", "the camera's current value"});
  keys.Add("focus_counts", settings.focus_counts, {0, kMaxCounts},
           {"fixed focus, in units of the camera; autofocus is always switched off", "0",
            "the camera's current value"});
}

}  // namespace

/// The keys of all kinds are listed; a key of another kind is ignored, not a fault.
void ListKeys(Settings& keys, CameraConfig& camera) {
  keys.Choose("kind", camera.kind, {{"v4l2", "v4l2"}, {"dv", "dv"}, {"recorded", "recorded"}},
              {"a camera connected to this computer, a DV camcorder on IEEE 1394, or a recording"});
  const auto is_kind = [&, known = keys.valid()](const char* kind) {
    return known && camera.kind == kind;
  };
  camera::RecordedCameraOptions& recorded = camera.connection.recorded;
  camera::V4l2CameraOptions& v4l2 = camera.connection.v4l2;
  keys.Choose("name", camera.name, CameraNames(""),
              {"required if there are two cameras", "\"side\""});
  keys.Add(
      "required_for", camera.required_for,
      {"[\"points\"]: corrected points are withdrawn while the lens of this camera is not valid",
       "[\"points\"]", "nothing"});
  keys.Add(
      "no_window", camera.declared.no_window,
      {"true: you declare that no pane of glass is in front of the lens, neither a window of a "
       "housing nor a door or filter; cameras.md, \"Calibrating a lens\""});
  keys.Add(
      "fixed_focus", camera.declared.fixed_focus,
      {"true: you declare that the focal length is the same in all frames of a calibration: no "
       "autofocus, no zoom drive that moves by itself"});
  keys.Add(
      "oblong_pixels", camera.declared.oblong_pixels,
      {"true: you declare that the pixels are not square, as those of a camera with an analogue "
       "signal or a scaled image"});
  keys.Add("device", v4l2.device,
           Required("for \"v4l2\": path, serial number, or serial number and port, as printed by "
                    "`plumbline cameras`; for \"dv\": the FIFO that DV frames are written to",
                    "\"Logitech-1234\"", is_kind("v4l2") || is_kind("dv")));
  std::optional<int> width, height;
  keys.Add("width_px", width, {1, kMaxSide_px},
           {"image size, together with height_px", "1920", "the largest that reaches rate_hz"});
  keys.Add("height_px", height, {1, kMaxSide_px}, {"image height, together with width_px", "1080"});
  v4l2.mode.size = {width.value_or(0), height.value_or(0)};
  keys.Add("rate_hz", recorded.rate_hz, {0.01, 1000},
           {"smallest frame rate of a camera; playback rate of a folder of images"});
  v4l2.mode.rate_hz = recorded.rate_hz;
  ListSettingKeys(keys, v4l2.settings);
  keys.Path("path", recorded.path,
            Required("for \"recorded\", like the next three: a folder of PGM images, or a table "
                     "t_s,file",
                     "\"frames\"", is_kind("recorded")));
  keys.Add("repeat", recorded.repeat, {"play the recording again and again"});
  keys.Add("serial", recorded.serial,
           {"serial number of the camera that made the recording; for \"dv\": the name under which "
            "the lenses of the camcorder are stored",
            "\"A1B2C3\""});
  camera.connection.dv = {.fifo = v4l2.device, .serial = recorded.serial};
  keys.Add("mode", recorded.mode, {"mode of that camera", "\"1920x1080 20 Hz\""});
}

void ListKeys(Settings& keys, target::Board& board) {
  keys.Choose("kind", board.kind,
              {{"chessboard", target::BoardKind::kChessboard},
               {"charuco", target::BoardKind::kCharuco},
               {"circles", target::BoardKind::kCircles},
               {"acircles", target::BoardKind::kAsymmetricCircles}},
              {"\"acircles\": circles with every other row shifted"});
  keys.Add("columns", board.columns, {3, 100}, {"inner corners per row, or circles per row"});
  keys.Add("rows", board.rows, {3, 100}, {"rows of inner corners or circles"});
  keys.Add("square_mm", board.square_m, kSquare,
           {"side of a square, or row spacing of the circles"});
  keys.Add("mark_mm", board.marker_m, kSquare,
           {"side of a ChArUco tag including its black border, or diameter of the circles", "7.0",
            "none"});
}

void ListKeys(Settings& keys, BoardConfig& board) {
  keys.Add("family", board.board.family,
           {"tag family of a ChArUco board; it should differ from that of [tags]"});
  keys.Add("views", board.views, {6, 200},
           {"least number of views; the calibration ends once the lens is certain enough"});
  board.max_views = std::max(board.max_views, board.views);
  keys.Add("most_views", board.max_views, {6, 400},
           {"largest number of views before the calibration is refused"});
  keys.Add("patience_s", board.patience_s, {1, 3600}, {"time limit of one calibration"});
  keys.Add("acceptable_px", board.acceptable_px, {0.001, 100},
           {"largest accepted standard deviation of the projection"});
  keys.Add("distance_mm", board.distance_m, {1, 1e6, kMetrePerMm},
           {"distance at which the projection is evaluated", "1500.0", "at infinity"});
  keys.Add("by_itself", board.by_itself,
           {"true: a requested calibration starts when the board comes into view; false: it starts "
            "by command 9"});
}

void ListKeys(Settings& keys, TagsConfig& tags) {
  keys.Document(
      "file", "text",
      Required("bodies and their tags: edit a copy of bodies.toml; cameras.md, \"Tags and bodies\"",
               "\"bodies.toml\""));
  keys.Add("family", tags.family, {"tag family"});
  keys.Add("threshold", tags.threshold, {0, 255},
           {"darker pixels count as black", "100", "adapts to the local brightness"});
  keys.Add("cell", tags.cell, {"the body with the cell's reference tags, at least two"});
  keys.Add("cell_xyz_mm", tags.X_WK.p, kPlaceRange, {"its position in the measurement frame"});
  Vec3 rpy_rad = Vec3::Zero();
  keys.Add("cell_rpy_deg", rpy_rad, kTurnRange,
           {"its orientation, R = Rz(yaw) Ry(pitch) Rx(roll)"});
  tags.X_WK.R = RotationFromRollPitchYaw(rpy_rad);
  keys.Add("place_sd_mm", tags.place_sd_m, {0.001, 100, kMetrePerMm},
           {"standard deviation of the declared reference tag positions, per axis; for other "
            "bodies: bodies.toml"});
  keys.Add("tool", tags.tool,
           {"the body that carries the tool tip, for command 11", "\"gripper\""});
  const SettingDoc tip =
      Required("position of the tip on that body", "[0.0, 0.0, 120.0]", !tags.tool.empty());
  if (tip.required) keys.Add("tip_mm", tags.tip_T, kPlaceRange, tip);
  if (!tip.required) keys.Document("tip_mm", "3 numbers", tip);
}

void ListKeys(Settings& keys, OverlayConfig& overlay) {
  using Display = OverlayConfig::Display;
  using Nominal = OverlayConfig::Nominal;
  keys.Choose(
      "display", overlay.display,
      {{"none", Display::kNone}, {"kms", Display::kKms}, {"framebuffer", Display::kFramebuffer}},
      {"\"kms\": a display without a desktop; \"framebuffer\": /dev/fb0"});
  keys.Add("device", overlay.device,
           {"device of the display", "\"/dev/dri/card0\"", "the first one"});
  std::optional<int> width, height;
  keys.Add("width_px", width, {640, 3840},
           {"picture size, together with height_px", "1920",
            "the display's, or 1280 x 720 without a display"});
  keys.Add("height_px", height, {480, 2160}, {"image height, together with width_px", "1080"});
  if (width && height) overlay.size = image::ImageSize{*width, *height};
  status::CameraName camera = status::CameraName::kNone;
  keys.Choose("camera", camera, CameraNames("both"),
              {"with two cameras: both images next to each other, or one of them"});
  if (camera != status::CameraName::kNone) overlay.camera = camera;
  keys.Path("objects", overlay.objects_file,
            {"table of virtual objects; read again whenever it is saved", "\"objects.toml\""});
  keys.Add("background", overlay.background, {"false: no camera image behind the objects"});
  keys.Add("exaggeration", overlay.exaggeration, {0.1, 1000},
           {"factor by which the deflection is drawn larger; shown on the display unless 1"});
  keys.Choose(
      "nominal", overlay.nominal,
      {{"hidden", Nominal::kHidden}, {"behind", Nominal::kBehind}, {"beside", Nominal::kBeside}},
      {"where the unloaded tool is drawn, relative to the deflected one"});
  keys.Add("stress", overlay.stress, {"true: bending objects are coloured by stress"});
  keys.Add("stress_full_MPa", overlay.stress_full_Pa, {0.1, 10000, kPaPerMPa},
           {"upper end of the colour scale"});
  keys.Add("grid_mm", overlay.grid_m, {0, 10000, kMetrePerMm},
           {"distance of the lines of a faint horizontal grid behind the objects; 0: no grid"});
  keys.Add("grid_z_mm", overlay.grid_z_m, {-100000, 100000, kMetrePerMm},
           {"height of the grid in the measurement frame"});
  keys.Add("near_mm", overlay.near_m, {0, 10000, kMetrePerMm},
           {"pairs of objects closer than this are reported; default of near_mm in objects.toml"});
}

}  // namespace plumbline::config
