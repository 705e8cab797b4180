// Zoom sensor on a digital input "lens moved", through libgpiod. It reports motion, no position.
#pragma once

#include <memory>
#include <string>

#include "drivers/zoom/line_debounce.h"
#include "drivers/zoom/zoom_kind.h"
#include "firmware-like/result.h"

struct gpiod_chip;
struct gpiod_line;

namespace plumbline::zoom {

struct GpioOptions {
  std::string chip;  ///< for example /dev/gpiochip0, or a chip's label
  int line = 0;      ///< line offset on the chip
  bool active_low = false;
  double debounce_s = 0.005;
};

/// Edges are queued by the kernel with monotonic time stamps, so none is missed between two
/// readings. The first reading after the line was opened reports `moved`, because earlier motion is
/// unknown.
class GpioZoom : public ZoomSensor {
 public:
  /// Fails for a negative line or a debounce time outside 0..1 s.
  static Result<std::unique_ptr<ZoomSensor>> Create(const GpioOptions& options, Clock clock);
  ~GpioZoom() override;

  ZoomResult Read(lens::ZoomReading& reading) override;
  std::string_view problem() const override { return problem_; }

 private:
  GpioZoom(GpioOptions options, Clock clock);
  bool Open();
  ZoomResult Disconnect(const std::string& why);

  const GpioOptions options_;
  const Clock clock_;
  gpiod_chip* chip_ = nullptr;
  gpiod_line* line_ = nullptr;  ///< owned by the chip
  BackOff back_off_;
  LineDebounce debounce_;
  bool just_opened_ = true;
  std::string problem_;
};

/// Zoom kind "gpio".
extern const ZoomKind kGpioKind;

}  // namespace plumbline::zoom
