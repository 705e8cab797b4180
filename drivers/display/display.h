// Interface of a display, independent of its kind.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

#include "drivers/clock.h"
#include "drivers/display/picture.h"
#include "firmware-like/image/image_size.h"
#include "firmware-like/result.h"

namespace plumbline::display {

// Pacing for displays without a refresh event.

/// Due time of the next picture [s]: one period after the previous due time, so that small delays
/// do not accumulate, or one period from now if that has already passed.
inline double NextPictureDue_s(double due_s, double now_s, double period_s) {
  return due_s + period_s > now_s ? due_s + period_s : now_s + period_s;
}

enum class DisplayResult : std::uint8_t {
  kReady,         ///< from Wait(): a picture of size() can be shown
  kShown,         ///< from Show(): the picture is queued for the screen
  kBusy,          ///< the previous picture is not on the screen yet
  kWaiting,       ///< no display; the next attempt is not due yet
  kLost,          ///< cannot be opened, was disconnected, or has no monitor
  kSizeMismatch,  ///< the picture does not have the current size(); draw it again
};

/// A display. Not thread-safe. It connects and reconnects by itself. There is no queue: a picture
/// is drawn from the newest data once the previous one is on the screen.
class Display {
 public:
  Display() = default;
  Display(const Display&) = delete;
  Display& operator=(const Display&) = delete;
  virtual ~Display() = default;

  /// Waits up to `timeout_s` until a picture can be shown. Probing the modes of a newly connected
  /// monitor takes the kernel additional time, observed to be at most one second.
  /// @return kReady, kBusy, kWaiting or kLost
  virtual DisplayResult Wait(double timeout_s) = 0;

  /// Picture size that the screen accepts; valid after kReady.
  virtual image::ImageSize size() const = 0;

  /// Shows a picture without waiting for the screen. @return kShown, kBusy, kLost or kSizeMismatch
  virtual DisplayResult Show(DrawnPicture& picture) = 0;

  /// Error of the last call that returned kWaiting, kLost or kSizeMismatch, with the location and
  /// the remedy; valid until the next call.
  virtual std::string_view problem() const = 0;
};

// Display without a screen, for snapshots and remote viewers only.

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
