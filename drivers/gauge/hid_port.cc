#include "drivers/gauge/hid_port.h"

#include <array>
#include <utility>

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

}  // namespace plumbline::gauge
