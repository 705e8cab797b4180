// Exclusive use of the key events of a HID keyboard, so that it types nowhere else.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "drivers/os/descriptor.h"

namespace plumbline::hid {

/// Folders in which the kernel lists devices; tests replace them.
struct InputFolders {
  std::string hidraw = "/sys/class/hidraw";
  std::string input = "/dev/input";
};

/// The input devices that belong to a hidraw device, such as /dev/input/event5.
std::vector<std::string> InputDevicesOf(const std::string& hidraw, const InputFolders& folders);

/// A device that types is an input device beside its hidraw device: what it sends also goes to the
/// console or the focused window. The kernel delivers the key events of a grabbed input device only
/// to the process that grabbed it (EVIOCGRAB [linux/input.h]); the hidraw device still receives
/// every report.
class KeyboardGrab {
 public:
  explicit KeyboardGrab(InputFolders folders = {}) : folders_(std::move(folders)) {}

  /// Grabs every input device that belongs to a hidraw device.
  /// @param hidraw  its device file, /dev/hidraw0
  /// @return        empty if all are grabbed or there is none; otherwise the reason with the
  ///                remedy, and none is grabbed
  std::string Grab(const std::string& hidraw);
  void Release() { grabbed_.clear(); }
  std::size_t count() const { return grabbed_.size(); }

 private:
  InputFolders folders_;
  std::vector<os::Descriptor> grabbed_;
};

}  // namespace plumbline::hid
