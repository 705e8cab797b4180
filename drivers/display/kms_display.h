// Display on a monitor without a desktop, through KMS with atomic mode setting and page flips.
#pragma once

#include <xf86drmMode.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "drivers/back_off.h"
#include "drivers/clock.h"
#include "drivers/display/display.h"
#include "drivers/display/pixel_packing.h"
#include "drivers/os/descriptor.h"
#include "firmware-like/image/image_size.h"
#include "firmware-like/lens/lens.h"
#include "firmware-like/result.h"

namespace plumbline::display {

// KMS output: a monitor with the CRTC and plane that drive it, and page flips on it.

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

// DRM dumb buffer: scan-out memory that every card provides, with or without a GPU.

/// XRGB, 32 bits per pixel, mapped for writing.
class DumbBuffer {
 public:
  /// @param card  open card; must outlive the buffer
  static Result<std::unique_ptr<DumbBuffer>> Make(int card, image::ImageSize size);
  ~DumbBuffer();
  DumbBuffer(const DumbBuffer&) = delete;
  DumbBuffer& operator=(const DumbBuffer&) = delete;

  void Fill(DrawnPicture& picture) { PackDrawn(picture, layout_, {memory_, bytes_}); }
  std::uint32_t framebuffer() const { return framebuffer_; }

 private:
  explicit DumbBuffer(int card) : card_(card) {}

  const int card_;
  PixelLayout layout_;
  std::uint32_t handle_ = 0, framebuffer_ = 0;
  std::uint8_t* memory_ = nullptr;
  std::size_t bytes_ = 0;
};

struct KmsOptions {
  std::string card = "/dev/dri/card0";
  std::string connector = {};   ///< "HDMI-A-1"; empty: the first one with a monitor
  image::ImageSize size{0, 0};  ///< of the mode; {0, 0}: the preferred one
};

/// Double-buffered and free of tearing. An unplugged monitor is detected within half a second and
/// used again when it reappears, with its mode at that time. Must be the DRM master of the card, so
/// no desktop may be running.
class KmsDisplay : public Display {
 public:
  static constexpr double kFlipTimeout_s = 2;          ///< then the card is reopened
  static constexpr double kHotplugPollPeriod_s = 0.5;  ///< polling period of the connector

  /// Fails for an empty card and for negative sizes.
  static Result<std::unique_ptr<Display>> Create(const KmsOptions& options, Clock clock,
                                                 Sleep sleep = SleepSeconds);

  DisplayResult Wait(double timeout_s) override;
  image::ImageSize size() const override { return output_ ? output_->size() : image::ImageSize{}; }
  DisplayResult Show(DrawnPicture& picture) override;
  std::string_view problem() const override { return problem_; }

 private:
  KmsDisplay(KmsOptions options, Clock clock, Sleep sleep);
  std::string Open();
  void Close();
  DisplayResult Disconnect(const std::string& why);
  DisplayResult WaitForFlip(double timeout_s);

  const KmsOptions options_;
  const Clock clock_;
  const Sleep sleep_;
  os::Descriptor card_;  ///< must outlive output_ and buffers_
  std::optional<KmsOutput> output_;
  std::array<std::unique_ptr<DumbBuffer>, 2> buffers_;
  std::size_t next_ = 0;  ///< back buffer
  bool mode_is_set_ = false;
  bool flipping_ = false;  ///< the event of the last page flip is pending
  double flip_requested_s_ = 0, last_hotplug_poll_s_ = 0;
  BackOff back_off_;
  std::string problem_;
};

}  // namespace plumbline::display
