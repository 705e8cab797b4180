// The keys of [camera], [zoom], [board], [tags] and [overlay].
#include <algorithm>

#include "app/config/daemon_settings.h"
#include "app/config/limits.h"
#include "firmware-like/geometry/rotation.h"

namespace plumbline {
namespace {

constexpr double kMostCounts = 1 << 24, kLargestSide = 16384, kPaPerMPa = 1e6;
constexpr NumberRange kSquare{0.01, 10000, kMetrePerMm};

/// @param none  the word for no camera in particular; empty: there is none
std::vector<Choice<CameraName>> CameraNames(std::string_view none) {
  std::vector<Choice<CameraName>> names;
  for (std::size_t k = none.empty() ? 1 : 0; k < kCameraNames.size(); ++k) {
    names.push_back({k == 0 ? none : kCameraNames[k], static_cast<CameraName>(k)});
  }
  return names;
}

/// A report of HID or an event costs nothing; a serial line at 9600 baud is busy for 20 ms.

void ListKeys(Settings& keys, ZoomSupervisionSettings& zoom) {
  keys.Add("zoom_band_counts", zoom.zoom_band_counts, {0, 10000}, {"a change up to it is ignored"});
  keys.Add("focus_band_counts", zoom.focus_band_counts, {0, 10000}, {"likewise"});
  keys.Add("settle_ms", zoom.settle_s, {0, 60000, kSecondPerMs},
           {"how long the lens must have been at rest"});
  keys.Add("lost_after_ms", zoom.lost_after_s, {100, 600000, kSecondPerMs},
           {"without an answer the sensor is lost after this time"});
  keys.Add("verify_patience_s", zoom.verify_patience_s, {0.1, 600},
           {"then the board is asked for"});
}

void ListSettingKeys(Settings& keys, CameraSettings& settings) {
  keys.Add("exposure_ms", settings.exposure_s, {0.001, 60000, kSecondPerMs},
           {"fixed, as are the next three", "8.0", "as the camera has it"});
  keys.Add("gain_counts", settings.gain_counts, {0, kMostCounts}, {.example = "100"});
  keys.Add("white_balance_K", settings.white_balance_K, {1000, 40000}, {.example = "5000"});
  keys.Add("focus_counts", settings.focus_counts, {0, kMostCounts},
           {"autofocus is always switched off", "0"});
}

}  // namespace

/// Keys of both kinds are listed; those of the other one are of no use, and no fault.
void ListKeys(Settings& keys, CameraConfig& camera) {
  keys.Choose("kind", camera.kind, {{"v4l2", "v4l2"}, {"recorded", "recorded"}},
              {"a camera of this computer, or a recording"});
  const auto of = [&, known = keys.good()](const char* kind) {
    return known && camera.kind == kind;
  };
  RecordedCameraOptions& recorded = camera.connection.recorded;
  V4l2CameraOptions& v4l2 = camera.connection.v4l2;
  keys.Choose("name", camera.name, CameraNames(""), {"needed if there are two", "\"side\""});
  keys.Add("device", v4l2.device,
           Required("of \"v4l2\": path, serial number, or serial number with its port",
                    "\"Logitech-1234\"", of("v4l2")));
  std::optional<int> width, height;
  keys.Add("width_px", width, {1, kLargestSide},
           {"with height_px", "1920", "the largest that is fast enough"});
  keys.Add("height_px", height, {1, kLargestSide}, {.example = "1080"});
  v4l2.mode.size = {width.value_or(0), height.value_or(0)};
  keys.Add("rate_hz", recorded.rate_hz, {0.01, 1000}, {});
  v4l2.mode.rate_hz = recorded.rate_hz;
  ListSettingKeys(keys, v4l2.settings);
  keys.Path("path", recorded.path,
            Required("of \"recorded\": a folder of PGM images or a table t_s,file; with the "
                     "next three",
                     "\"frames\"", of("recorded")));
  keys.Add("repeat", recorded.repeat, {});
  keys.Add("serial", recorded.serial, {"of the camera that recorded it", "\"A1B2C3\""});
  keys.Add("mode", recorded.mode, {"likewise", "\"1920x1080 20 Hz\""});
}

/// Keys of all kinds are listed; those of another one are of no use, and no fault.
void ListKeys(Settings& keys, ZoomConfig& zoom, const std::string& camera) {
  ZoomConnection& c = zoom.connection;
  std::vector<Choice<std::string>> kinds;
  for (const ZoomKind* kind : ZoomKinds()) kinds.push_back({kind->name, std::string(kind->name)});
  kinds.push_back({"none", ""});
  keys.Choose("kind", zoom.kind, kinds, Required("what senses the zoom", "\"visca\""));
  const bool of_camera = zoom.kind == "v4l2" && !camera.empty();
  if (of_camera) c.visca.device = camera;
  keys.Add("device", c.visca.device,
           {.sentence = "of \"visca\", with the next four; of \"v4l2\"",
            .example = "\"/dev/serial/by-id/...\"",
            .otherwise = "of \"v4l2\": the camera's",
            .required = zoom.kind == "visca" || (zoom.kind == "v4l2" && !of_camera)});
  c.v4l2 = {c.visca.device, kQuickZoomPeriod_s};
  keys.Add("baud", c.visca.baud, {9600, 38400}, {"9600 or 38400"});
  keys.Add("address", c.visca.address, {1, 7}, {"of the camera on the line"});
  keys.Add("timeout_ms", c.visca.timeout_s, {10, 10000, kSecondPerMs}, {"of \"hid\" too"});
  c.hid.timeout_s = c.visca.timeout_s;
  keys.Add("optical_max_counts", c.visca.optical_max_counts, {1, kMostCounts},
           {"beyond it the zoom is digital, and nothing is calibrated"});
  keys.Document("profile", "text",
                {"of \"hid\": a file of profiles/zoom", "\"computar-lensconnect\""});
  keys.Add("serial", c.hid.serial, {"of two equal devices", "\"A1\""});
  const bool gpio = zoom.kind == "gpio";
  keys.Add("chip", c.gpio.chip,
           Required("of \"gpio\", with the next three", "\"/dev/gpiochip0\"", gpio));
  keys.Add("line", c.gpio.line, {0, 1023},
           {.sentence = "its number on the chip",
            .example = "4",
            .otherwise = "none",
            .required = gpio});
  keys.Add("active_low", c.gpio.active_low, {});
  keys.Add("debounce_ms", c.gpio.debounce_s, {0, 1000, kSecondPerMs}, {});
  keys.Document("file", "text", {"of \"replay\": t_s,zoom_counts,...", "\"zoom.csv\""});
  const ZoomKind* const kind = FindZoomKind(zoom.kind);
  zoom.period_s = kind == nullptr ? kZoomPeriod_s : kind->period_s;
  keys.Add("period_ms", zoom.period_s, {10, 1000, kSecondPerMs},
           {.sentence = "from reading to reading", .otherwise = "50; 100 for \"visca\""});
  ListKeys(keys, zoom.supervision);
}

void ListKeys(Settings& keys, Board& board) {
  keys.Choose("kind", board.kind,
              {{"chessboard", BoardKind::kChessboard},
               {"charuco", BoardKind::kCharuco},
               {"circles", BoardKind::kCircles},
               {"acircles", BoardKind::kAsymmetricCircles}},
              {"of \"acircles\" every other row is shifted"});
  keys.Add("columns", board.columns, {3, 100},
           {"inner corners in a row; of circles, the circles in a row"});
  keys.Add("rows", board.rows, {3, 100}, {});
  keys.Add("square_mm", board.square_m, kSquare,
           {"side of a square; of circles, from one row to the next"});
  keys.Add(
      "mark_mm", board.mark_m, kSquare,
      {"side of a ChArUco tag with its black border, or diameter of the circles", "7.0", "none"});
}

void ListKeys(Settings& keys, BoardConfig& board) {
  keys.Add("family", board.board.family, {"of ChArUco's tags; another one than that of [tags]"});
  keys.Add("views", board.views, {8, 200}, {"before the lens is judged for the first time"});
  board.most_views = std::max(board.most_views, board.views);
  keys.Add("most_views", board.most_views, {8, 400}, {"after these the calibration is refused"});
  keys.Add("patience_s", board.patience_s, {1, 3600}, {"after this time too"});
  keys.Add("acceptable_px", board.acceptable_px, {0.001, 100},
           {"standard deviation of the projection that is accepted"});
  keys.Add("distance_mm", board.distance_m, {1, 1e6, kMetrePerMm},
           {"at which that is judged", "1500.0", "at infinity"});
  keys.Add("by_itself", board.by_itself,
           {"a board in view starts a calibration that is asked for; false: command 9 does"});
}

void ListKeys(Settings& keys, TagsConfig& tags) {
  keys.Document("file", "text",
                Required("what carries tags (copy and edit the one beside this file): "
                         "MANUAL.md, \"Tags and bodies in an image\"",
                         "\"bodies.toml\""));
  keys.Add("family", tags.family, {});
  keys.Add("threshold", tags.threshold, {0, 255}, {"", "100", "by the light around each place"});
  keys.Add("cell", tags.cell, {"the body of the cell's fixed marks, at least two tags"});
  keys.Add("cell_xyz_mm", tags.X_WK.p, kPlaceRange, {"its pose in the measurement frame"});
  Vec3 rpy_rad = Vec3::Zero();
  keys.Add("cell_rpy_deg", rpy_rad, kTurnRange, {});
  tags.X_WK.R = RotationFromRollPitchYaw(rpy_rad);
  keys.Add("place_sd_mm", tags.place_sd_m, {0.001, 100, kMetrePerMm},
           {"how well the places of the cell's marks are known, one axis; of other bodies: "
            "bodies.toml"});
  keys.Add("tool", tags.tool,
           {"the body that carries the tool's tip, for command 11", "\"gripper\""});
  const Meaning tip = Required("the tip on that body", "[0.0, 0.0, 120.0]", !tags.tool.empty());
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
  keys.Add("device", overlay.device, {"", "\"/dev/dri/card0\"", "the first one"});
  std::optional<int> width, height;
  keys.Add("width_px", width, {640, 1920},
           {"with height_px", "1920", "the display's, 1280 x 720 without one"});
  keys.Add("height_px", height, {480, 1080}, {.example = "1080"});
  if (width && height) overlay.size = ImageSize{*width, *height};
  CameraName camera = CameraName::kNone;
  keys.Choose("camera", camera, CameraNames("both"),
              {"of two: beside or below each other, or the one that is shown"});
  if (camera != CameraName::kNone) overlay.camera = camera;
  keys.Path("objects", overlay.objects_file,
            {"virtual objects; the file is read again when it is saved", "\"objects.toml\""});
  keys.Add("background", overlay.background, {"false: no camera image behind them"});
  keys.Add("exaggeration", overlay.exaggeration, {0.1, 1000},
           {"times the deflection; shown on the screen unless it is 1"});
  keys.Choose(
      "nominal", overlay.nominal,
      {{"hidden", Nominal::kHidden}, {"behind", Nominal::kBehind}, {"beside", Nominal::kBeside}},
      {"the tool without load: hidden, or behind or beside the deflected one"});
  keys.Add("stress", overlay.stress, {"true: what bends is coloured by stress"});
  keys.Add("stress_full_MPa", overlay.stress_full_Pa, {0.1, 10000, kPaPerMPa},
           {"the top of the colour scale"});
  keys.Add("near_mm", overlay.near_m, {0, 10000, kMetrePerMm},
           {"of pairs of objects that state none: reported when nearer"});
}

}  // namespace plumbline
