#include "drivers/gauge/gauge.h"

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
#include "drivers/os/descriptor.h"
#include "drivers/os/serial_line.h"

namespace plumbline::gauge {
namespace {

constexpr int kMaxReports = 64;  // in one call: a device that sends without end must not hold it

}  // namespace

HidPort::HidPort(hid::HidName id, hid::InputFolders folders)
    : id_(std::move(id)), grab_(std::move(folders)) {}

bool HidPort::Open() {
  if (!device_.Open(id_)) {
    problem_ = hid::kOpenRemedy;
    return false;
  }
  keyboard_ = device_.IsKeyboard();
  keys_.Clear();
  if (keyboard_) problem_ = grab_.Grab(device_.Path());
  if (!keyboard_ || problem_.empty()) return true;
  Close();
  return false;
}

void HidPort::Close() {
  grab_.Release();
  device_.Close();
}

bool HidPort::Receive(double timeout_s, std::string& text) {
  for (int k = 0; k < kMaxReports; ++k) {
    std::array<std::uint8_t, hid::kMaxReportBytes + 1> report;
    const int size = device_.Read(report, k == 0 ? timeout_s : 0);
    if (size < 0) {
      problem_ = hid::kLostRemedy;
      return false;
    }
    if (size == 0) break;
    const std::span<const std::uint8_t> bytes(report.data(), static_cast<std::size_t>(size));
    if (keyboard_) {
      keys_.Push(bytes, text);
    } else {
      AppendReportText(bytes, text);
    }
  }
  return true;
}

namespace {

// Serial line of a dial gauge.

class SerialPort : public GaugePort {
 public:
  /// @param settings  without fault
  SerialPort(std::string device, os::SerialSettings settings);

  bool Open() override;
  void Close() override { fd_.Reset(); }
  bool is_open() const override { return static_cast<bool>(fd_); }
  bool Receive(double timeout_s, std::string& text) override;
  std::string name() const override { return device_; }
  std::string settings_to_check() const override;

 private:
  const std::string device_;
  const os::SerialSettings settings_;
  os::Descriptor fd_;
};

SerialPort::SerialPort(std::string device, os::SerialSettings settings)
    : device_(std::move(device)), settings_(settings) {}

bool SerialPort::Open() {
  fd_.Reset(open(device_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (fd_ && os::ConfigureSerialLine(fd_.get(), settings_)) return true;
  problem_ = files::OpenErrorText(errno, files::kSerialLine);
  Close();
  return false;
}

bool SerialPort::Receive(double timeout_s, std::string& text) {
  pollfd waiting{.fd = fd_.get(), .events = POLLIN, .revents = 0};
  const int ready = poll(&waiting, 1, std::max(0, static_cast<int>(std::ceil(1e3 * timeout_s))));
  if (ready == 0 || (ready < 0 && errno == EINTR)) return true;
  std::array<char, 256> bytes;
  const ssize_t size = ready < 0 ? -1 : read(fd_.get(), bytes.data(), bytes.size());
  if (size > 0) {
    text.append(bytes.data(), static_cast<std::size_t>(size));
    return true;
  }
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return true;
  problem_ = size == 0 ? "hung up; is the adapter plugged in?" : std::strerror(errno);
  return false;
}

std::string SerialPort::settings_to_check() const {
  return fmt::format("`format`, `baud` and `parity` of [[gauge]] (now {})",
                     os::SerialSettingsText(settings_));
}

constexpr double kSilence_s = 0.2;  // longer than any pause within a line
constexpr double kUnsettled_s = 3;  // nobody presses a button without a pause for so long

/// Received text as it is shown in a message: control characters as "?".
std::string Shown(std::string_view text) {
  constexpr std::size_t kLongest = 24;
  std::string shown(text.substr(0, kLongest));
  for (char& c : shown) {
    if (c < ' ' || c > '~') c = '?';
  }
  return text.size() > kLongest ? shown + "..." : shown;
}

std::unique_ptr<GaugePort> PortFor(const GaugeOptions& options) {
  if (options.kind == GaugeKind::kHid) return std::make_unique<HidPort>(options.hid);
  return std::make_unique<SerialPort>(options.device, options.line);
}

}  // namespace

Gauge::Gauge(GaugeOptions options, Clock clock)
    : options_(std::move(options)), port_(PortFor(options_)), clock_(clock) {}

Gauge::Gauge(GaugeOptions options, std::unique_ptr<GaugePort> port, Clock clock)
    : options_(std::move(options)), port_(std::move(port)), clock_(clock) {}

bool Gauge::Open() {
  if (!port_->Open()) return false;
  back_off_.Well();
  receiver_.Clear();
  unread_.clear();
  settled_ = interrupted_ = endless_logged_ = false;
  opened_s_ = last_byte_s_ = clock_();
  return true;
}

GaugeResult Gauge::Lose() {
  port_->Close();
  back_off_.Failed(clock_());
  problem_ = fmt::format("{}: {}", port_->name(), port_->problem());
  return GaugeResult::kLost;
}

bool Gauge::WasSilent(double now_s) const {
  return now_s - last_byte_s_ >= kSilence_s;
}

bool Gauge::NeverSilent(double now_s) const {
  return !settled_ && now_s - opened_s_ >= kUnsettled_s;
}

GaugeResult Gauge::Read(double timeout_s, double& reading_m) {
  if (!port_->is_open()) {
    if (!back_off_.Due(clock_())) return GaugeResult::kWaiting;
    if (!Open()) return Lose();
  }
  if (unread_.empty() && !port_->Receive(timeout_s, unread_)) return Lose();
  const double now_s = clock_();
  if (unread_.empty()) return Silence(now_s);
  // A line that was interrupted may continue or not: it is discarded up to its end.
  if (WasSilent(now_s)) {
    settled_ = true;
    interrupted_ = !receiver_.empty();
  }
  last_byte_s_ = now_s;
  return TakeLine(now_s, reading_m);
}

/// Reports the beginning of a line that does not continue.
GaugeResult Gauge::Silence(double now_s) {
  if (!WasSilent(now_s)) return GaugeResult::kNothing;
  const bool counts = std::exchange(settled_, true);
  if (!counts || receiver_.empty() || std::exchange(endless_logged_, true)) {
    return GaugeResult::kNothing;
  }
  return NotOfFormat(receiver_.pending(), ", to which no end of a line was received,");
}

/// Takes the received bytes up to the end of a line, and the line.
GaugeResult Gauge::TakeLine(double now_s, double& reading_m) {
  for (std::size_t at = 0; at < unread_.size(); ++at) {
    const auto line = receiver_.Push(unread_[at]);
    if (!line) continue;
    endless_logged_ = false;
    if (!settled_ && !NeverSilent(now_s)) continue;
    unread_.erase(0, std::min(unread_.find_first_not_of("\r\n", at), unread_.size()));
    if (std::exchange(interrupted_, false)) {
      return Unreadable("a line was interrupted; press the button again");
    }
    if (!settled_ && options_.format->parse(*line).kind != GaugeLine::Kind::kOther) {
      return Unreadable("it sends without pause; set it to send when its button is pressed");
    }
    return Judge(*line, reading_m);
  }
  unread_.clear();
  const bool counts = settled_ || NeverSilent(now_s);
  if (!counts || !receiver_.overlong() || std::exchange(endless_logged_, true)) {
    return GaugeResult::kNothing;
  }
  return NotOfFormat(receiver_.pending(), ", which goes on without the end of a line,");
}

GaugeResult Gauge::Unreadable(const std::string& why) {
  problem_ = fmt::format("{}: unreadable data: {}", port_->name(), why);
  return GaugeResult::kUnreadable;
}

GaugeResult Gauge::NotOfFormat(std::string_view text, std::string_view what) {
  return Unreadable(fmt::format(
      "\"{}\"{} is not a line of the format \"{}\"; check {} against the gauge's manual",
      Shown(text), what, options_.format->name, port_->settings_to_check()));
}

GaugeResult Gauge::Judge(std::string_view text, double& reading_m) {
  const GaugeLine line = options_.format->parse(text);
  switch (line.kind) {
    case GaugeLine::Kind::kReading:
      reading_m = line.value * MetresPer(line.unit.value_or(options_.unit));
      return GaugeResult::kReading;
    case GaugeLine::Kind::kFault:
      problem_ =
          fmt::format("{}: the gauge reports {}: {}", port_->name(), Shown(text), line.fault);
      return GaugeResult::kFault;
    case GaugeLine::Kind::kOther:
      break;
  }
  return NotOfFormat(text, "");
}

}  // namespace plumbline::gauge
