// Display configuration of plumbline-view, [overlay] of plumbline.toml.
#pragma once

#include <optional>
#include <string>

#include "firmware-like/image/image_size.h"
#include "firmware-like/lens/lens.h"
#include "firmware-like/status/camera_status.h"

namespace plumbline::config {

class NamedFiles;
class TomlTable;
struct VisionConfig;

struct OverlayConfig {
  enum class Display { kNone, kKms, kFramebuffer };
  /// Where the unloaded tool is drawn, relative to the deflected one.
  enum class Nominal { kHidden, kBehind, kBeside };

  Display display = Display::kNone;
  std::string device;                        ///< device of the display; empty: the first one
  std::optional<status::CameraName> camera;  ///< the camera shown; all if nullopt
  std::optional<image::ImageSize> size;      ///< if nullopt, the display's, else 1280 x 720
  std::string objects_file;                  ///< object table; empty: only the tool's axis is drawn
  bool background = true;                    ///< draw the camera image behind the objects
  double exaggeration = 1;                   ///< factor by which the deflection is drawn larger
  Nominal nominal = Nominal::kHidden;
  bool stress = false;            ///< colour bending objects by stress
  double stress_full_Pa = 250e6;  ///< upper end of the colour scale
  double grid_m = 0;              ///< distance of the lines of the ground grid; 0: no grid
  double grid_z_m = 0;            ///< height of the grid in the measurement frame
  double near_m = 0;              ///< default distance for pairs of the object table
};

/// @param vision  defines the camera names that are allowed
OverlayConfig OverlayFromToml(const TomlTable& table, const NamedFiles& files,
                              const VisionConfig& vision);

}  // namespace plumbline::config
