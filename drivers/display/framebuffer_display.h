// Display on the kernel framebuffer, /dev/fb0, for computers without KMS.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "drivers/back_off.h"
#include "drivers/clock.h"
#include "drivers/display/display.h"
#include "drivers/display/pixel_packing.h"
#include "drivers/os/descriptor.h"
#include "firmware-like/image/image_size.h"
#include "firmware-like/result.h"

namespace plumbline::display {

struct FramebufferOptions {
  std::string device = "/dev/fb0";
  double rate_hz = 30;  ///< picture rate; the framebuffer has no refresh event
};

/// Copies pictures into the memory of the framebuffer, where they are visible at once, so tearing
/// is possible. A changed mode is detected, and a lost device is reopened. The kernel's text
/// console writes into the same memory; switch its cursor off (vt.global_cursor_default=0).
class FramebufferDisplay : public Display {
 public:
  /// Fails for an empty device and for a rate outside 0.1..240 Hz.
  static Result<std::unique_ptr<Display>> Create(const FramebufferOptions& options, Clock clock,
                                                 Sleep sleep = SleepSeconds);
  ~FramebufferDisplay() override;

  DisplayResult Wait(double timeout_s) override;
  image::ImageSize size() const override { return layout_.size; }
  DisplayResult Show(DrawnPicture& picture) override;
  std::string_view problem() const override { return problem_; }

 private:
  struct Mode {
    PixelLayout layout;
    std::size_t offset = 0;        ///< offset of the visible part [bytes]
    std::size_t memory_bytes = 0;  ///< size of the mapping
    bool operator==(const Mode&) const = default;
  };

  FramebufferDisplay(FramebufferOptions options, Clock clock, Sleep sleep);
  std::string Open();
  std::string ReadMode(Mode& mode) const;
  void Close();
  DisplayResult Disconnect(const std::string& why);

  const FramebufferOptions options_;
  const Clock clock_;
  const Sleep sleep_;
  os::Descriptor fd_;
  Mode mode_;
  PixelLayout layout_;
  std::uint8_t* memory_ = nullptr;
  double next_s_ = 0;
  BackOff back_off_;
  std::string problem_;
};

}  // namespace plumbline::display
