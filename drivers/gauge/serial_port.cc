#include "drivers/gauge/serial_port.h"

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

}  // namespace plumbline::gauge
