#include "drivers/display/kms_display.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <xf86drm.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "drivers/files/open_failure.h"

namespace plumbline::display {
namespace {

/// Callback of libdrm for a page-flip event.
void OnFlipped(int, unsigned, unsigned, unsigned, unsigned, void* user) {
  *static_cast<bool*>(user) = false;
}

}  // namespace

KmsDisplay::KmsDisplay(KmsOptions options, Clock clock, Sleep sleep)
    : options_(std::move(options)), clock_(clock), sleep_(sleep) {}

Result<std::unique_ptr<Display>> KmsDisplay::Create(const KmsOptions& options, Clock clock,
                                                    Sleep sleep) {
  if (options.card.empty()) return Error{"the display card is empty"};
  if (options.size.width < 0 || options.size.height < 0) {
    return Error{"the display size is negative"};
  }
  return std::unique_ptr<Display>(new KmsDisplay(options, clock, sleep));
}

/// @return why there is no display; empty: success
std::string KmsDisplay::Open() {
  card_.Reset(open(options_.card.c_str(), O_RDWR | O_CLOEXEC));
  if (!card_) {
    return files::OpenErrorText(errno, files::kDisplayDevice);
  }
  if (drmSetClientCap(card_.get(), DRM_CLIENT_CAP_UNIVERSAL_PLANES, 1) != 0 ||
      drmSetClientCap(card_.get(), DRM_CLIENT_CAP_ATOMIC, 1) != 0) {
    return "has no atomic mode setting. Use the display kind \"framebuffer\".";
  }
  auto output = ChooseKmsOutput(card_.get(), options_.connector, options_.size);
  if (!output) return output.error();
  for (auto& buffer : buffers_) {
    auto made = DumbBuffer::Make(card_.get(), output->size());
    if (!made) return made.error();
    buffer = std::move(made).value();
  }
  output_ = std::move(output).value();
  last_hotplug_poll_s_ = clock_();
  return "";
}

void KmsDisplay::Close() {
  for (auto& buffer : buffers_) buffer.reset();
  output_.reset();
  mode_is_set_ = flipping_ = false;
  card_.Reset();
}

DisplayResult KmsDisplay::Disconnect(const std::string& why) {
  problem_ = fmt::format("{}{} {}", options_.card, output_ ? ", " + output_->name + ":" : ":", why);
  Close();
  back_off_.Failed(clock_());
  return DisplayResult::kLost;
}

DisplayResult KmsDisplay::WaitForFlip(double timeout_s) {
  const double left_s = std::clamp(timeout_s, 0.0, kFlipTimeout_s);
  pollfd waited{.fd = card_.get(), .events = POLLIN, .revents = 0};
  if (poll(&waited, 1, static_cast<int>(1e3 * left_s)) > 0) {
    drmEventContext events{};
    events.version = 3;
    events.page_flip_handler2 = OnFlipped;
    if ((waited.revents & POLLIN) == 0 || drmHandleEvent(card_.get(), &events) != 0) {
      return Disconnect("card lost");
    }
  }
  if (!flipping_) return DisplayResult::kReady;
  if (clock_() - flip_requested_s_ < kFlipTimeout_s) return DisplayResult::kBusy;
  return Disconnect("the card does not complete page flips; reopening");
}

DisplayResult KmsDisplay::Wait(double timeout_s) {
  const double now_s = clock_();
  if (!output_) {
    if (!back_off_.Due(now_s)) {
      sleep_(std::max(timeout_s, 0.0));
      return DisplayResult::kWaiting;
    }
    if (const std::string why = Open(); !why.empty()) return Disconnect(why);
    back_off_.Well();
  }
  if (now_s - last_hotplug_poll_s_ > kHotplugPollPeriod_s) {
    last_hotplug_poll_s_ = now_s;
    if (!IsStillConnected(card_.get(), output_->connector))
      return Disconnect("monitor disconnected");
  }
  return flipping_ ? WaitForFlip(timeout_s) : DisplayResult::kReady;
}

DisplayResult KmsDisplay::Show(DrawnPicture& picture) {
  if (!output_) return DisplayResult::kLost;
  if (flipping_) return DisplayResult::kBusy;
  if (picture.size() != size()) return DisplayResult::kSizeMismatch;
  DumbBuffer& buffer = *buffers_[next_];
  buffer.Fill(picture);
  const int error = FlipTo(card_.get(), *output_, buffer.framebuffer(), !mode_is_set_, &flipping_);
  if (error == EBUSY) return DisplayResult::kBusy;
  if (error == EACCES || error == EPERM) {
    return Disconnect("another program controls the display. Stop the desktop.");
  }
  if (error != 0) return Disconnect(fmt::format("page flip rejected: {}", std::strerror(error)));
  mode_is_set_ = flipping_ = true;
  flip_requested_s_ = clock_();
  next_ = 1 - next_;
  return DisplayResult::kShown;
}

}  // namespace plumbline::display
