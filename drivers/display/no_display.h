// Display without a screen, for snapshots and remote viewers only.
#pragma once

#include <memory>

#include "drivers/clock.h"
#include "drivers/display/display.h"
#include "firmware-like/image/image_size.h"
#include "firmware-like/result.h"

namespace plumbline::display {

struct NoDisplayOptions {
  image::ImageSize size{1280, 720};
  double rate_hz = 30;
};

/// Becomes ready `rate_hz` times a second and discards the pictures.
class NoDisplay : public Display {
 public:
  /// Fails for sizes outside 16..8192 pixels and rates outside 0.1..240 Hz.
  static Result<std::unique_ptr<Display>> Create(const NoDisplayOptions& options, Clock clock,
                                                 Sleep sleep = SleepSeconds);

  DisplayResult Wait(double timeout_s) override;
  image::ImageSize size() const override { return options_.size; }
  DisplayResult Show(DrawnPicture& picture) override;
  std::string_view problem() const override { return problem_; }

 private:
  NoDisplay(const NoDisplayOptions& options, Clock clock, Sleep sleep);

  const NoDisplayOptions options_;
  const Clock clock_;
  const Sleep sleep_;
  double next_s_ = 0;
  std::string_view problem_;
};

}  // namespace plumbline::display
