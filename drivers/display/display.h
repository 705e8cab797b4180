// What the drawing process asks of a display, whatever it is reached through.
#pragma once

#include <cstdint>
#include <string_view>

#include "drivers/display/picture.h"

namespace plumbline {

enum class DisplayResult : std::uint8_t {
  kReady,      ///< of Wait(): a picture of size() may be shown
  kShown,      ///< of Show(): it is on its way to the screen
  kBusy,       ///< the last picture is not on the screen yet
  kWaiting,    ///< no display; the next attempt is not due yet
  kLost,       ///< cannot be opened, went away, or has no monitor
  kOtherSize,  ///< the picture is not as large as size() is now; draw another one
};

/// Words for a log line: "the monitor is gone".
std::string_view DisplayResultText(DisplayResult result);

/// A display. Used by one thread. It connects by itself and comes back by itself. There is no
/// queue: a picture is drawn when the last one is on the screen, from what is newest then.
class Display {
 public:
  Display() = default;
  Display(const Display&) = delete;
  Display& operator=(const Display&) = delete;
  virtual ~Display() = default;

  /// Waits until a picture may be shown, at most `timeout_s`. Where a monitor has to be asked what
  /// it can do, as after plugging it in, the kernel's own time is added, a second at most by
  /// experience.
  /// @return kReady, kBusy, kWaiting or kLost
  virtual DisplayResult Wait(double timeout_s) = 0;

  /// Of the pictures that the screen takes; valid after kReady.
  virtual ImageSize size() const = 0;

  /// Does not wait for the screen. @return kShown, kBusy, kLost or kOtherSize
  virtual DisplayResult Show(DrawnPicture& picture) = 0;

  /// What the last call that was neither kReady, kShown nor kBusy met, with its place and what to
  /// do; valid until the next call.
  virtual std::string_view problem() const = 0;
};

}  // namespace plumbline
