#include "drivers/hid/hid_device.h"

#include <fmt/format.h>
#include <hidapi/hidapi.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>

#include "drivers/hid/keyboard_grab.h"

namespace plumbline::hid {
namespace {

// hidapi keeps the text of its last error in a global variable, which these two functions free.
std::mutex global_error_mutex;

constexpr unsigned short kGenericDesktop = 0x01, kKeyboard = 0x06;

}  // namespace

std::string NameText(const HidName& name) {
  return fmt::format("HID {:04X}:{:04X}{}{}", name.vendor_id, name.product_id,
                     name.serial.empty() ? "" : ", serial ", name.serial);
}

std::vector<std::string> DeviceFilesOf(const HidName& name) {
  const std::lock_guard lock(global_error_mutex);
  const std::unique_ptr<hid_device_info, decltype(&hid_free_enumeration)> all(
      hid_enumerate(static_cast<unsigned short>(name.vendor_id),
                    static_cast<unsigned short>(name.product_id)),
      hid_free_enumeration);
  const std::wstring serial(name.serial.begin(), name.serial.end());
  for (const hid_device_info* info = all.get(); info != nullptr; info = info->next) {
    const bool wanted =
        serial.empty() || (info->serial_number != nullptr && serial == info->serial_number);
    if (!wanted || info->path == nullptr) continue;
    std::vector<std::string> files = {info->path};
    const std::vector<std::string> inputs = InputDevicesOf(info->path, {});
    files.insert(files.end(), inputs.begin(), inputs.end());
    return files;
  }
  return {};
}

bool HidDevice::Open(const HidName& name) {
  Close();
  const std::wstring serial(name.serial.begin(), name.serial.end());
  const std::lock_guard lock(global_error_mutex);
  device_ = hid_open(static_cast<unsigned short>(name.vendor_id),
                     static_cast<unsigned short>(name.product_id),
                     serial.empty() ? nullptr : serial.c_str());
  return device_ != nullptr;
}

void HidDevice::Close() {
  if (device_ != nullptr) hid_close(device_);
  device_ = nullptr;
}

int HidDevice::Read(std::span<std::uint8_t> report, double timeout_s) {
  const int wait_ms = timeout_s > 0 ? std::max(1, static_cast<int>(std::ceil(1e3 * timeout_s))) : 0;
  return hid_read_timeout(device_, report.data(), report.size(), wait_ms);
}

bool HidDevice::Write(std::span<const std::uint8_t> report) {
  return hid_write(device_, report.data(), report.size()) >= 0;
}

std::string HidDevice::Path() const {
  const hid_device_info* const info = hid_get_device_info(device_);
  return info != nullptr && info->path != nullptr ? info->path : "";
}

bool HidDevice::IsKeyboard() const {
  for (const hid_device_info* info = hid_get_device_info(device_); info != nullptr;
       info = info->next) {
    if (info->usage_page == kGenericDesktop && info->usage == kKeyboard) return true;
  }
  return false;
}

}  // namespace plumbline::hid
