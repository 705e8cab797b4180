// Interface of a display, independent of its kind.
#pragma once

#include <cstdint>
#include <string_view>

#include "drivers/display/picture.h"
#include "firmware-like/image/image_size.h"

namespace plumbline::display {

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

}  // namespace plumbline::display
