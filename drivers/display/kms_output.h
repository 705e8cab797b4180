// A monitor and the way to it through the kernel's mode setting (KMS), by atomic requests.
#pragma once

#include <xf86drmMode.h>

#include <cstdint>
#include <string>

#include "firmware-like/lens/lens.h"
#include "firmware-like/result.h"

namespace plumbline {

/// A connected monitor with the controller and the plane that feed it.
struct KmsOutput {
  std::string name;  ///< of the connector, "HDMI-A-1"
  std::uint32_t connector = 0, crtc = 0, plane = 0;
  drmModeModeInfo mode{};

  /// Numbers of properties, by the kernel's names for them.
  struct {
    std::uint32_t connector_crtc, crtc_active, crtc_mode;
    std::uint32_t plane_framebuffer, plane_crtc;
    std::uint32_t plane_src_x, plane_src_y, plane_src_w, plane_src_h;
    std::uint32_t plane_crtc_x, plane_crtc_y, plane_crtc_w, plane_crtc_h;
  } property{};

  ImageSize size() const { return {mode.hdisplay, mode.vdisplay}; }
};

/// Asks the monitors at an open card what they can do, which takes their time.
/// @param connector  by name; empty: the first one that has a monitor
/// @param size       the mode to take; {0, 0}, or a size that the monitor has not: what it prefers
Result<KmsOutput> ChooseKmsOutput(int card, const std::string& connector, ImageSize size);

/// What the kernel knows without asking the monitor.
bool IsStillConnected(int card, std::uint32_t connector);

/// Puts a framebuffer on the screen with the next refresh; does not wait for it. When it is there,
/// a page-flip event with `user` comes from the card.
/// @param with_mode  sets the mode, too, as the first picture needs it
/// @return 0, or the kernel's error as a positive number
int FlipTo(int card, const KmsOutput& output, std::uint32_t framebuffer, bool with_mode,
           void* user);

}  // namespace plumbline
