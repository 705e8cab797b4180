#include "drivers/display/framebuffer_display.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/fb.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "drivers/display/display.h"
#include "drivers/files/open_failure.h"
#include "drivers/ioctl.h"

namespace plumbline::display {

FramebufferDisplay::FramebufferDisplay(FramebufferOptions options, Clock clock, Sleep sleep)
    : options_(std::move(options)), clock_(clock), sleep_(sleep) {}

FramebufferDisplay::~FramebufferDisplay() {
  Close();
}

Result<std::unique_ptr<Display>> FramebufferDisplay::Create(const FramebufferOptions& options,
                                                            Clock clock, Sleep sleep) {
  if (options.device.empty()) return Error{"the framebuffer device is empty"};
  if (!(options.rate_hz >= 0.1 && options.rate_hz <= 240)) {
    return Error{"the picture rate is outside 0.1..240 Hz"};
  }
  return std::unique_ptr<Display>(new FramebufferDisplay(options, clock, sleep));
}

/// Reads the current mode. @return why it cannot be used; empty: `mode` is complete
std::string FramebufferDisplay::ReadMode(Mode& mode) const {
  fb_var_screeninfo var{};
  fb_fix_screeninfo fix{};
  if (IoctlAgain(fd_.get(), FBIOGET_VSCREENINFO, &var) != 0 ||
      IoctlAgain(fd_.get(), FBIOGET_FSCREENINFO, &fix) != 0) {
    return fmt::format("is not a framebuffer, or was lost: {}", std::strerror(errno));
  }
  const auto bits = [](const fb_bitfield& field) { return ColourBits{field.offset, field.length}; };
  if (fix.type != FB_TYPE_PACKED_PIXELS || fix.visual != FB_VISUAL_TRUECOLOR || var.red.msb_right) {
    return "is not a packed true-colour framebuffer";
  }
  mode.layout = {.size = {static_cast<int>(var.xres), static_cast<int>(var.yres)},
                 .stride = fix.line_length,
                 .bits = var.bits_per_pixel,
                 .red = bits(var.red),
                 .green = bits(var.green),
                 .blue = bits(var.blue)};
  mode.memory_bytes = fix.smem_len;
  mode.offset = std::size_t{var.yoffset} * fix.line_length +
                std::size_t{var.xoffset} * var.bits_per_pixel / 8;
  const std::size_t left = mode.memory_bytes - std::min(mode.offset, mode.memory_bytes);
  if (const Result<void> valid = CheckLayout(mode.layout, left); !valid) {
    return "has " + valid.error();
  }
  return "";
}

std::string FramebufferDisplay::Open() {
  fd_.Reset(open(options_.device.c_str(), O_RDWR | O_CLOEXEC));
  if (!fd_) {
    return files::OpenErrorText(errno, files::kDisplayDevice);
  }
  if (std::string why = ReadMode(mode_); !why.empty()) return why;
  void* memory =
      mmap(nullptr, mode_.memory_bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd_.get(), 0);
  if (memory == MAP_FAILED) return fmt::format("cannot be mapped: {}", std::strerror(errno));
  memory_ = static_cast<std::uint8_t*>(memory);
  layout_ = mode_.layout;
  return "";
}

void FramebufferDisplay::Close() {
  if (memory_ != nullptr) munmap(memory_, mode_.memory_bytes);
  memory_ = nullptr;
  fd_.Reset();
}

DisplayResult FramebufferDisplay::Disconnect(const std::string& why) {
  Close();
  back_off_.Failed(clock_());
  problem_ = fmt::format("{} {}", options_.device, why);
  return DisplayResult::kLost;
}

DisplayResult FramebufferDisplay::Wait(double timeout_s) {
  const double left_s = next_s_ - clock_();
  if (left_s > 0) sleep_(std::clamp(left_s, 0.0, std::max(timeout_s, 0.0)));
  if (left_s > timeout_s) return DisplayResult::kBusy;
  if (fd_) {
    Mode now;
    if (const std::string why = ReadMode(now); !why.empty()) return Disconnect(why);
    if (now != mode_) Close();
  }
  if (!fd_) {
    if (!back_off_.Due(clock_())) {
      sleep_(std::max(timeout_s, 0.0));
      return DisplayResult::kWaiting;
    }
    if (const std::string why = Open(); !why.empty()) return Disconnect(why);
    back_off_.Well();
  }
  return DisplayResult::kReady;
}

DisplayResult FramebufferDisplay::Show(DrawnPicture& picture) {
  if (!fd_) return DisplayResult::kLost;
  if (picture.size() != layout_.size) return DisplayResult::kSizeMismatch;
  PackDrawn(picture, layout_, {memory_ + mode_.offset, mode_.memory_bytes - mode_.offset});
  next_s_ = NextPictureDue_s(next_s_, clock_(), 1 / options_.rate_hz);
  return DisplayResult::kShown;
}

}  // namespace plumbline::display
