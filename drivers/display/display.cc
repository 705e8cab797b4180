#include "drivers/display/display.h"

#include <algorithm>
#include <utility>

namespace plumbline::display {

NoDisplay::NoDisplay(const NoDisplayOptions& options, Clock clock, Sleep sleep)
    : options_(options), clock_(clock), sleep_(sleep) {}

Result<std::unique_ptr<Display>> NoDisplay::Create(const NoDisplayOptions& options, Clock clock,
                                                   Sleep sleep) {
  const auto& [width, height] = options.size;
  if (width < 16 || height < 16 || width > 8192 || height > 8192) {
    return Error{"the picture size is outside 16..8192 pixels"};
  }
  if (!(options.rate_hz >= 0.1 && options.rate_hz <= 240)) {
    return Error{"the picture rate is outside 0.1..240 Hz"};
  }
  return std::unique_ptr<Display>(new NoDisplay(options, clock, sleep));
}

DisplayResult NoDisplay::Wait(double timeout_s) {
  const double left_s = next_s_ - clock_();
  if (left_s > 0) sleep_(std::clamp(left_s, 0.0, std::max(timeout_s, 0.0)));
  return left_s > timeout_s ? DisplayResult::kBusy : DisplayResult::kReady;
}

DisplayResult NoDisplay::Show(DrawnPicture&) {
  next_s_ = NextPictureDue_s(next_s_, clock_(), 1 / options_.rate_hz);
  return DisplayResult::kShown;
}

}  // namespace plumbline::display
