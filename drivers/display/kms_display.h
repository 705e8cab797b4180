// Display on a monitor without a desktop, through KMS with atomic mode setting and page flips.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>

#include "drivers/back_off.h"
#include "drivers/clock.h"
#include "drivers/display/display.h"
#include "drivers/display/dumb_buffer.h"
#include "drivers/display/kms_output.h"
#include "drivers/os/descriptor.h"
#include "firmware-like/image/image_size.h"
#include "firmware-like/result.h"

namespace plumbline::display {

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
