// Serial line of a dial gauge.
#pragma once

#include "drivers/gauge/gauge_port.h"
#include "drivers/os/descriptor.h"
#include "drivers/os/serial_line.h"

namespace plumbline::gauge {

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

}  // namespace plumbline::gauge
