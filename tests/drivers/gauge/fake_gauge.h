// Fake dial gauge at the far end of a pseudo-terminal.
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <cstdlib>
#include <string>
#include <string_view>

#include "drivers/os/descriptor.h"

namespace plumbline::test {

/// Its device exists until it is destroyed.
class FakeGauge {
 public:
  FakeGauge() : end_(posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)) {
    if (!end_ || grantpt(end_.get()) != 0 || unlockpt(end_.get()) != 0) std::abort();
    device_ = ptsname(end_.get());
  }
  const std::string& device() const { return device_; }
  void Send(std::string_view text) const {
    if (write(end_.get(), text.data(), text.size()) != static_cast<ssize_t>(text.size()))
      std::abort();
  }

 private:
  os::Descriptor end_;
  std::string device_;
};

}  // namespace plumbline::test
