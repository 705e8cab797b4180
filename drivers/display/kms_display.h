// A monitor, without a desktop: the kernel's mode setting by atomic requests and page flips.
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
#include "firmware-like/result.h"

namespace plumbline {

struct KmsOptions {
  std::string card = "/dev/dri/card0";
  std::string connector = {};  ///< "HDMI-A-1"; empty: the first one with a monitor
  ImageSize size{0, 0};        ///< of the mode; {0, 0}: what the monitor prefers
};

/// Two buffers: one on the screen, one to copy the next picture into, never torn. A monitor that is
/// unplugged is noticed within half a second, and found again when it comes back, with the mode
/// that it has then. Needs to be the card's only master: no desktop beside it.
class KmsDisplay : public Display {
 public:
  static constexpr double kFlipPatience_s = 2;  ///< then the card is opened anew
  static constexpr double kLookPeriod_s = 0.5;  ///< at the connector

  /// Refuses an empty card and negative sizes.
  static Result<std::unique_ptr<Display>> Create(const KmsOptions& options, Clock clock,
                                                 Sleep sleep = SleepSeconds);

  DisplayResult Wait(double timeout_s) override;
  ImageSize size() const override { return output_ ? output_->size() : ImageSize{}; }
  DisplayResult Show(DrawnPicture& picture) override;
  std::string_view problem() const override { return problem_; }

 private:
  KmsDisplay(KmsOptions options, Clock clock, Sleep sleep);
  std::string Open();
  void Close();
  DisplayResult Lost(const std::string& why);
  DisplayResult WaitForFlip(double timeout_s);

  const KmsOptions options_;
  const Clock clock_;
  const Sleep sleep_;
  Descriptor card_;  ///< outlives what was made of it, below
  std::optional<KmsOutput> output_;
  std::array<std::unique_ptr<DumbBuffer>, 2> buffers_;
  std::size_t next_ = 0;  ///< the buffer that is not on the screen
  bool mode_is_set_ = false;
  bool flipping_ = false;  ///< the event of the last flip has not come
  double flipped_s_ = 0, looked_s_ = 0;
  BackOff back_off_;
  std::string problem_;
};

}  // namespace plumbline
