// [overlay] of plumbline.toml: what plumbline-view shows, and where.
#pragma once

#include <optional>
#include <string>

#include "firmware-like/lens/lens.h"
#include "firmware-like/status/camera_status.h"

namespace plumbline {

class NamedFiles;
class TomlTable;
struct VisionConfig;

struct OverlayConfig {
  enum class Display { kNone, kKms, kFramebuffer };
  /// How the tool without load is shown beside the deflected one.
  enum class Nominal { kHidden, kBehind, kBeside };

  Display display = Display::kNone;
  std::string device;                ///< of the display; empty: the first one
  std::optional<CameraName> camera;  ///< that is shown; nothing: each
  std::optional<ImageSize>
      size;                  ///< of the picture; nothing: the display's, 1280 x 720 without one
  std::string objects_file;  ///< the object table; empty: nothing virtual but the tool's axis
  bool background = true;    ///< the camera's image behind it
  double exaggeration = 1;   ///< of the deflection, where it is shown
  Nominal nominal = Nominal::kHidden;
  bool stress = false;            ///< objects that bend are coloured by stress
  double stress_full_Pa = 250e6;  ///< the top of the colour scale
  double near_m = 0;              ///< of pairs of the object table that state none
};

/// @param vision  whose cameras may be named
OverlayConfig OverlayFromToml(const TomlTable& table, const NamedFiles& files,
                              const VisionConfig& vision);

}  // namespace plumbline
