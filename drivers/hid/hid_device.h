// HID device that is opened by its name, through hidapi (hidraw).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "drivers/hid/hid_name.h"

struct hid_device_;  // hidapi's hid_device

namespace plumbline::hid {

/// "HID 0FE7:4001, serial A1".
std::string NameText(const HidName& name);

/// What to do if a device cannot be opened, and if it is lost.
inline constexpr const char* kOpenRemedy =
    "cannot be opened. Check that it is plugged in and that this user may open it: "
    "ls -l /dev/hidraw* (the udev rule grants access to the group plumbline).";
inline constexpr const char* kLostRemedy = "lost. Check its cable.";

/// Device files that the driver of such a device opens: /dev/hidraw0 of the first device of that
/// name and, if it types, its input devices. Empty if it is not connected.
std::vector<std::string> DeviceFilesOf(const HidName& name);

/// Not thread-safe. Does not reconnect by itself.
class HidDevice {
 public:
  HidDevice() = default;
  ~HidDevice() { Close(); }
  HidDevice(const HidDevice&) = delete;
  HidDevice& operator=(const HidDevice&) = delete;

  /// Opens the first device of that name. False if there is none, or it cannot be opened.
  bool Open(const HidName& name);
  /// Also discards reports that were not read.
  void Close();
  explicit operator bool() const { return device_ != nullptr; }

  /// Waits up to `timeout_s` (not at all if 0) for an input report; a device with report ids sends
  /// the id as the first byte. Requires an open device, like the functions below.
  /// @return  length; 0 if there was no report in time; negative if the device was lost
  int Read(std::span<std::uint8_t> report, double timeout_s);
  /// Sends an output report. False if the device was lost.
  bool Write(std::span<const std::uint8_t> report);

  /// Device file, such as /dev/hidraw0; empty if it is not known.
  std::string Path() const;
  /// Whether the device is a keyboard (usage page 1, usage 6 [HID Usage Tables]).
  bool IsKeyboard() const;

 private:
  hid_device_* device_ = nullptr;
};

}  // namespace plumbline::hid
