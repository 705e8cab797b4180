// KMS output: a monitor with the CRTC and plane that drive it, and page flips on it.
#pragma once

#include <xf86drmMode.h>

#include <cstdint>
#include <string>

#include "firmware-like/image/image_size.h"
#include "firmware-like/lens/lens.h"
#include "firmware-like/result.h"

namespace plumbline::display {

/// A connected monitor with its CRTC and primary plane.
struct KmsOutput {
  std::string name;  ///< connector name, "HDMI-A-1"
  std::uint32_t connector = 0, crtc = 0, plane = 0;
  drmModeModeInfo mode{};

  /// Ids of the KMS properties.
  struct {
    std::uint32_t connector_crtc, crtc_active, crtc_mode;
    std::uint32_t plane_framebuffer, plane_crtc;
    std::uint32_t plane_src_x, plane_src_y, plane_src_w, plane_src_h;
    std::uint32_t plane_crtc_x, plane_crtc_y, plane_crtc_w, plane_crtc_h;
  } property{};

  image::ImageSize size() const { return {mode.hdisplay, mode.vdisplay}; }
};

/// Probes the connectors of an open card, which can take up to a second, and chooses an output.
/// @param connector  name; if empty, the first one with a monitor
/// @param size       of the mode; {0, 0} or a size that the monitor lacks: its preferred mode
/// @return           the output, or why there is none
Result<KmsOutput> ChooseKmsOutput(int card, const std::string& connector, image::ImageSize size);

/// Connection state known to the kernel, without probing the monitor.
bool IsStillConnected(int card, std::uint32_t connector);

/// Requests a page flip to a framebuffer at the next refresh, without waiting. When it is complete
/// the card sends a page-flip event with `user`.
/// @param with_mode  also sets the mode, as required for the first picture
/// @return           0, or the positive errno of the kernel
int FlipTo(int card, const KmsOutput& output, std::uint32_t framebuffer, bool with_mode,
           void* user);

}  // namespace plumbline::display
