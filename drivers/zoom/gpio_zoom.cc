#include "drivers/zoom/gpio_zoom.h"

#include <fmt/format.h>
#include <gpiod.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "drivers/files/open_failure.h"
#include "drivers/zoom/registry.h"

namespace plumbline::zoom {
namespace {

constexpr int kMaxEdgesPerReading = 1000;  // bounds a reading if the line chatters endlessly

constexpr ZoomOption kGpioOptions[] = {
    {.key = "chip",
     .value = [](ZoomConnection& to) -> std::string& { return to.gpio.chip; },
     .description = "for \"gpio\", like the next three: GPIO chip",
     .example = "\"/dev/gpiochip0\"",
     .required = true},
    {.key = "line",
     .value = [](ZoomConnection& to) -> int& { return to.gpio.line; },
     .min = 0,
     .max = 1023,
     .description = "number of the line on the chip",
     .example = "4",
     .default_text = "none",
     .required = true},
    {.key = "active_low",
     .value = [](ZoomConnection& to) -> bool& { return to.gpio.active_low; },
     .description = "true: the line is inverted"},
    {.key = "debounce_ms",
     .value = [](ZoomConnection& to) -> double& { return to.gpio.debounce_s; },
     .min = 0,
     .max = 1000,
     .to_si = kSecondPerMs,
     .description = "debounce time"},
};

}  // namespace

Result<std::unique_ptr<ZoomSensor>> GpioZoom::Create(const GpioOptions& options, Clock clock) {
  if (options.line < 0) return Error{fmt::format("gpio: line {} is negative", options.line)};
  if (!(options.debounce_s >= 0 && options.debounce_s <= 1)) {
    return Error{fmt::format("gpio: debounce time {} s is outside 0..1", options.debounce_s)};
  }
  return std::unique_ptr<ZoomSensor>(new GpioZoom(options, clock));
}

GpioZoom::GpioZoom(GpioOptions options, Clock clock)
    : options_(std::move(options)), clock_(clock), debounce_(options_.debounce_s) {}

GpioZoom::~GpioZoom() {
  if (chip_ != nullptr) gpiod_chip_close(chip_);
}

ZoomResult GpioZoom::Disconnect(const std::string& why) {
  if (chip_ != nullptr) gpiod_chip_close(chip_);
  chip_ = nullptr;
  line_ = nullptr;
  back_off_.Failed(clock_());
  problem_ = fmt::format("{} line {}: {}", options_.chip, options_.line, why);
  return ZoomResult::kLost;
}

bool GpioZoom::Open() {
  chip_ = gpiod_chip_open_lookup(options_.chip.c_str());
  if (chip_ == nullptr) {
    Disconnect("the chip " + files::OpenErrorText(errno, files::kGpioChip));
    return false;
  }
  line_ = gpiod_chip_get_line(chip_, static_cast<unsigned>(options_.line));
  const int flags = options_.active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0;
  if (line_ == nullptr ||
      gpiod_line_request_both_edges_events_flags(line_, "plumbline", flags) != 0) {
    Disconnect(fmt::format("cannot be monitored: {}. Check the line with gpioinfo.",
                           std::strerror(errno)));
    return false;
  }
  debounce_ = LineDebounce(options_.debounce_s);
  const int level = gpiod_line_get_value(line_);
  if (level < 0) {
    Disconnect(
        fmt::format("cannot be read: {}. Check the line with gpioinfo.", std::strerror(errno)));
    return false;
  }
  debounce_.Edge(level > 0, clock_());
  just_opened_ = true;
  return true;
}

ZoomResult GpioZoom::Read(lens::ZoomReading& reading) {
  if (line_ == nullptr) {
    if (!back_off_.Due(clock_())) return ZoomResult::kWaiting;
    if (!Open()) return ZoomResult::kLost;
  }
  for (int edges = 0; edges < kMaxEdgesPerReading; ++edges) {
    const timespec at_once{};
    const int waits = gpiod_line_event_wait(line_, &at_once);
    if (waits == 0) break;
    gpiod_line_event event{};
    if (waits < 0 || gpiod_line_event_read(line_, &event) != 0) {
      return Disconnect(fmt::format("lost: {}. Check that the GPIO chip is still present.",
                                    std::strerror(errno)));
    }
    debounce_.Edge(
        event.event_type == GPIOD_LINE_EVENT_RISING_EDGE,
        static_cast<double>(event.ts.tv_sec) + 1e-9 * static_cast<double>(event.ts.tv_nsec));
  }
  back_off_.Well();
  const double now_s = clock_();
  reading = lens::ZoomReading{};
  reading.moved = debounce_.TakeMoved(now_s) || std::exchange(just_opened_, false);
  reading.motion = debounce_.Moving(now_s) ? lens::LensMotion::kMoving : lens::LensMotion::kSettled;
  reading.time_s = now_s;
  return ZoomResult::kOk;
}

const ZoomKind kGpioKind{
    .name = "gpio",
    .make = [](const ZoomConnection& to) { return GpioZoom::Create(to.gpio, to.clock); },
    .identity =
        [](const ZoomConnection& to) { return fmt::format("{} {}", to.gpio.chip, to.gpio.line); },
    .device =
        [](const ZoomConnection& to) {  // a chip label is not a path
          return Result<std::string>(to.gpio.chip.starts_with('/') ? to.gpio.chip : "");
        },
    .remedy = "the udev rule 65-plumbline.rules grants access: run udevadm trigger",
    .period_s = kQuickZoomPeriod_s,
    .options = kGpioOptions};

}  // namespace plumbline::zoom
