// The kernel's plain framebuffer, /dev/fb0, for computers whose graphics have no KMS.
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
#include "firmware-like/result.h"

namespace plumbline {

struct FramebufferOptions {
  std::string device = "/dev/fb0";
  double rate_hz = 30;  ///< of the pictures; the framebuffer itself has no say in it
};

/// Copies pictures into the framebuffer's memory, where they are seen at once: one that is shown
/// while the screen is being read is torn. A changed mode is noticed, a device that goes away
/// opened anew. The kernel's text console writes into the same memory; switch its cursor off
/// (vt.global_cursor_default=0).
class FramebufferDisplay : public Display {
 public:
  /// Refuses an empty device and a rate outside 0.1..240 Hz.
  static Result<std::unique_ptr<Display>> Create(const FramebufferOptions& options, Clock clock,
                                                 Sleep sleep = SleepSeconds);
  ~FramebufferDisplay() override;

  DisplayResult Wait(double timeout_s) override;
  ImageSize size() const override { return layout_.size; }
  DisplayResult Show(DrawnPicture& picture) override;
  std::string_view problem() const override { return problem_; }

 private:
  struct Mode {
    PixelLayout layout;
    std::size_t offset = 0;        ///< of the visible part in the memory
    std::size_t memory_bytes = 0;  ///< of all
    bool operator==(const Mode&) const = default;
  };

  FramebufferDisplay(FramebufferOptions options, Clock clock, Sleep sleep);
  std::string Open();
  std::string ReadMode(Mode& mode) const;
  void Close();
  DisplayResult Lost(const std::string& why);

  const FramebufferOptions options_;
  const Clock clock_;
  const Sleep sleep_;
  Descriptor fd_;
  Mode mode_;
  PixelLayout layout_;
  std::uint8_t* memory_ = nullptr;
  double next_s_ = 0;
  BackOff back_off_;
  std::string problem_;
};

}  // namespace plumbline
