#include "drivers/gauge/serial_gauge.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <utility>

#include "drivers/files/open_failure.h"

namespace plumbline::gauge {
namespace {

constexpr double kSilence_s = 0.2;  // longer than any pause within a line
constexpr double kUnsettled_s = 3;  // nobody presses a button without a pause for so long

/// A received line as it is shown in a message: control characters as "?".
std::string Shown(std::string_view text) {
  std::string shown(text);
  for (char& c : shown) {
    if (c < ' ' || c > '~') c = '?';
  }
  return shown;
}

}  // namespace

SerialGauge::SerialGauge(SerialGaugeOptions options, Clock clock)
    : options_(std::move(options)), clock_(clock) {}

bool SerialGauge::Open() {
  fd_.Reset(open(options_.device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!fd_ || !os::ConfigureSerialLine(fd_.get(), options_.line)) {
    Lose(files::OpenErrorText(errno, files::kSerialLine));
    return false;
  }
  back_off_.Well();
  receiver_.Clear();
  unread_.clear();
  settled_ = interrupted_ = false;
  opened_s_ = last_byte_s_ = clock_();
  return true;
}

GaugeResult SerialGauge::Lose(const std::string& why) {
  fd_.Reset();
  back_off_.Failed(clock_());
  problem_ = fmt::format("{}: {}", options_.device, why);
  return GaugeResult::kLost;
}

GaugeResult SerialGauge::Read(double timeout_s, double& reading_m) {
  if (!fd_) {
    if (!back_off_.Due(clock_())) return GaugeResult::kWaiting;
    if (!Open()) return GaugeResult::kLost;
  }
  if (unread_.empty()) {
    pollfd waiting{.fd = fd_.get(), .events = POLLIN, .revents = 0};
    const int ready = poll(&waiting, 1, std::max(0, static_cast<int>(std::ceil(1e3 * timeout_s))));
    if (ready < 0 && errno != EINTR) return Lose(std::strerror(errno));
    if (ready > 0) {
      std::array<char, 256> bytes;
      const ssize_t size = read(fd_.get(), bytes.data(), bytes.size());
      if (size == 0) return Lose("hung up; is the adapter plugged in?");
      if (size < 0 && errno != EAGAIN && errno != EINTR) return Lose(std::strerror(errno));
      if (size > 0) unread_.assign(bytes.data(), static_cast<std::size_t>(size));
    }
  }
  const double now_s = clock_();
  if (unread_.empty()) {
    settled_ = settled_ || now_s - last_byte_s_ >= kSilence_s;
    return GaugeResult::kNothing;
  }
  // A line that was interrupted may continue or not: it is discarded up to its end.
  if (now_s - last_byte_s_ >= kSilence_s) {
    settled_ = true;
    interrupted_ = !receiver_.empty();
  }
  last_byte_s_ = now_s;
  for (std::size_t at = 0; at < unread_.size(); ++at) {
    const auto line = receiver_.Push(unread_[at]);
    if (!line) continue;
    if (!settled_ && now_s - opened_s_ < kUnsettled_s) continue;
    unread_.erase(0, std::min(unread_.find_first_not_of("\r\n", at), unread_.size()));
    if (!settled_)
      return Unreadable("it sends without pause; set it to send when its button is pressed");
    if (std::exchange(interrupted_, false)) {
      return Unreadable("a line was interrupted; press the button again");
    }
    return Judge(*line, reading_m);
  }
  unread_.clear();
  return GaugeResult::kNothing;
}

GaugeResult SerialGauge::Unreadable(const std::string& why) {
  problem_ = fmt::format("{}: {}", options_.device, why);
  return GaugeResult::kUnreadable;
}

GaugeResult SerialGauge::Judge(std::string_view text, double& reading_m) {
  const GaugeLine line = options_.format->parse(text);
  switch (line.kind) {
    case GaugeLine::Kind::kReading:
      reading_m = line.value * MetresPer(line.unit.value_or(options_.unit));
      return GaugeResult::kReading;
    case GaugeLine::Kind::kFault:
      problem_ =
          fmt::format("{}: the gauge reports {}: {}", options_.device, Shown(text), line.fault);
      return GaugeResult::kFault;
    case GaugeLine::Kind::kOther:
      break;
  }
  problem_ = fmt::format(
      "{}: \"{}\" is not a line of the format \"{}\" at {}; check `format`, `baud` and `parity` of "
      "[[gauge]] against the gauge's manual",
      options_.device, Shown(text), options_.format->name, os::SerialSettingsText(options_.line));
  return GaugeResult::kUnreadable;
}

}  // namespace plumbline::gauge
