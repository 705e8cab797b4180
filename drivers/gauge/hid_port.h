// Dial gauge, or the interface of one, as a HID device.
#pragma once

#include "drivers/gauge/gauge_port.h"
#include "drivers/gauge/report_text.h"
#include "drivers/hid/hid_device.h"
#include "drivers/hid/keyboard_grab.h"

namespace plumbline::gauge {

/// A device that types is opened only if its keys can be taken exclusively.
class HidPort : public GaugePort {
 public:
  explicit HidPort(hid::HidName id, hid::InputFolders folders = {});

  bool Open() override;
  void Close() override;
  bool is_open() const override { return static_cast<bool>(device_); }
  bool Receive(double timeout_s, std::string& text) override;
  std::string name() const override { return NameText(id_); }
  std::string settings_to_check() const override { return "`format` of [[gauge]]"; }

 private:
  const hid::HidName id_;
  hid::HidDevice device_;
  hid::KeyboardGrab grab_;
  bool keyboard_ = false;
  KeyReports keys_;
};

}  // namespace plumbline::gauge
