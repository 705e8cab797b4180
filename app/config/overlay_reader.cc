#include <algorithm>

#include "app/config/camera_config.h"
#include "app/config/named_files.h"
#include "app/config/overlay_config.h"
#include "app/config/toml_reader.h"

namespace plumbline {
namespace {

constexpr double kPaPerMPa = 1e6;
constexpr NumberRange kExaggeration{0.1, 1000};
constexpr NumberRange kStress{0.1, 10000, kPaPerMPa};
constexpr NumberRange kNear{0, 10000, kMetrePerMm};

void SizeFromToml(const TomlTable& table, OverlayConfig& overlay) {
  const auto width = table.Integer("width_px", 640, 1920);
  const auto height = table.Integer("height_px", 480, 1080);
  if (table.Has("width_px") != table.Has("height_px")) {
    table.AddFault("width_px", "and height_px must stand together, or neither");
  }
  if (width && height) overlay.size = ImageSize{*width, *height};
}

/// A name, or "both".
void ShownFromToml(const TomlTable& table, const VisionConfig& vision, OverlayConfig& overlay) {
  if (table.String("camera").value_or("both") == "both") return;
  overlay.camera = CameraNameFromToml(table, "camera");
  const bool known = std::any_of(vision.cameras.begin(), vision.cameras.end(),
                                 [&](const auto& one) { return one.name == overlay.camera; });
  if (overlay.camera && !known) {
    table.AddFault("camera", "is the name of no [[camera]]; give it to one, or \"both\" here");
  }
}

}  // namespace

OverlayConfig OverlayFromToml(const TomlTable& table, const NamedFiles& files,
                              const VisionConfig& vision) {
  using Display = OverlayConfig::Display;
  using Nominal = OverlayConfig::Nominal;
  OverlayConfig overlay;
  overlay.display = table
                        .OneOf<Display>("display", {{"none", Display::kNone},
                                                    {"kms", Display::kKms},
                                                    {"framebuffer", Display::kFramebuffer}})
                        .value_or(overlay.display);
  overlay.device = table.String("device").value_or("");
  if (!overlay.device.empty() && overlay.device.front() != '/') {
    table.AddFault("device", "is not an absolute path such as /dev/dri/card0 or /dev/fb0");
  }
  SizeFromToml(table, overlay);
  ShownFromToml(table, vision, overlay);
  if (const auto objects = table.String("objects")) overlay.objects_file = files.Beside(*objects);
  overlay.background = table.Bool("background").value_or(overlay.background);
  overlay.exaggeration = table.Number("exaggeration", kExaggeration).value_or(overlay.exaggeration);
  overlay.nominal = table
                        .OneOf<Nominal>("nominal", {{"hidden", Nominal::kHidden},
                                                    {"behind", Nominal::kBehind},
                                                    {"beside", Nominal::kBeside}})
                        .value_or(overlay.nominal);
  overlay.stress = table.Bool("stress").value_or(overlay.stress);
  overlay.stress_full_Pa =
      table.Number("stress_full_MPa", kStress).value_or(overlay.stress_full_Pa);
  overlay.near_m = table.Number("near_mm", kNear).value_or(overlay.near_m);
  return overlay;
}

}  // namespace plumbline
