#include "drivers/hid/keyboard_grab.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/input.h>
#include <sys/ioctl.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

namespace plumbline::hid {
namespace {

namespace fs = std::filesystem;

/// Names of the entries of a folder that begin with `prefix`; none if it cannot be read.
std::vector<std::string> NamesIn(const fs::path& folder, std::string_view prefix) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    std::string name = it->path().filename().string();
    if (name.starts_with(prefix)) names.push_back(std::move(name));
  }
  return names;
}

}  // namespace

std::vector<std::string> InputDevicesOf(const std::string& hidraw, const InputFolders& folders) {
  const fs::path inputs =
      fs::path(folders.hidraw) / fs::path(hidraw).filename() / "device" / "input";
  std::vector<std::string> devices;
  for (const std::string& input : NamesIn(inputs, "input")) {
    for (const std::string& event : NamesIn(inputs / input, "event")) {
      devices.push_back(folders.input + "/" + event);
    }
  }
  return devices;
}

std::string KeyboardGrab::Grab(const std::string& hidraw) {
  Release();
  for (const std::string& path : InputDevicesOf(hidraw, folders_)) {
    os::Descriptor device(open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
    if (device && ioctl(device.get(), EVIOCGRAB, 1) == 0) {
      grabbed_.push_back(std::move(device));
      continue;
    }
    const int error = errno;
    Release();
    return fmt::format(
        "it types on {}, which cannot be taken exclusively: {}; check that the udev rule grants "
        "it to the group plumbline and that no other program holds it",
        path, std::strerror(error));
  }
  return "";
}

}  // namespace plumbline::hid
