// A digital input that says "the lens moved", through libgpiod. It knows no position.
#pragma once

#include <memory>
#include <string>

#include "drivers/zoom/line_debounce.h"
#include "drivers/zoom/zoom_kind.h"
#include "firmware-like/result.h"

struct gpiod_chip;
struct gpiod_line;

namespace plumbline {

struct GpioOptions {
  std::string chip;  ///< for example /dev/gpiochip0, or a chip's label
  int line = 0;      ///< its offset
  bool active_low = false;
  double debounce_s = 0.005;
};

/// Edges are taken from the kernel with their own (monotonic) times, so that none is missed between
/// two readings. The first reading after the line was opened says moved: nobody watched before.
class GpioZoom : public ZoomSensor {
 public:
  /// Refuses a negative line and a debounce time outside 0..1 s.
  static Result<std::unique_ptr<ZoomSensor>> Create(const GpioOptions& options, Clock clock);
  ~GpioZoom() override;

  ZoomResult Read(ZoomReading& reading) override;
  std::string_view problem() const override { return problem_; }

 private:
  GpioZoom(GpioOptions options, Clock clock);
  bool Open();
  ZoomResult Lost(const std::string& why);

  const GpioOptions options_;
  const Clock clock_;
  gpiod_chip* chip_ = nullptr;
  gpiod_line* line_ = nullptr;  ///< the chip's
  BackOff back_off_;
  LineDebounce debounce_;
  bool unwatched_ = true;
  std::string problem_;
};

/// A digital input that says that the lens moved.
extern const ZoomKind kGpioKind;

}  // namespace plumbline
