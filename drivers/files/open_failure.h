// Messages for files and devices that cannot be opened: the reason and the remedy.
#pragma once

#include <string>
#include <string_view>

namespace plumbline {

/// What to do about a file or folder that cannot be read, by what is at `path` now: a missing
/// folder is named, and so are the owner that keeps this user out and the group that would not.
/// Follows a reason: "; check the name: ls /etc/plumbline". Empty where nothing is found.
std::string ReadRemedy(const std::string& path);

/// The same for a file that cannot be written: its folder, its permissions, its file system.
std::string WriteRemedy(const std::string& path);

/// "cannot be read: No such file or directory; check the name: ls /etc/plumbline".
/// @param reason  why, without a remedy ("No such file or directory")
std::string CannotBeRead(const std::string& path, std::string_view reason);

/// "cannot be written: Permission denied; ...".
std::string CannotBeWritten(const std::string& path, std::string_view reason);

/// A kind of device, for the remedy where one cannot be opened.
struct DeviceKind {
  const char* group;      ///< whose members may open it on Debian; empty: root alone
  const char* if_absent;  ///< what to check where it is not there
  const char* if_wrong;   ///< what to check where another kind of file is at its path
};

inline constexpr DeviceKind kSerialLine{
    "dialout", "is the adapter plugged in, and is this its name (ls /dev/serial/by-id)?",
    "it is no serial line"};
inline constexpr DeviceKind kCameraDevice{"video", "is the camera plugged in (plumbline cameras)?",
                                          "it is no camera"};
inline constexpr DeviceKind kDisplayDevice{
    "video", "there is no such device: ls /dev/dri /dev/fb*, set device of [overlay]",
    "it is no display"};
inline constexpr DeviceKind kGpioChip{"plumbline", "check `chip` by gpiodetect",
                                      "check `chip` by gpiodetect"};

/// "cannot be opened: Permission denied; user maria must be in the group dialout: ...".
/// @param error  errno of the attempt
std::string CannotBeOpened(int error, const DeviceKind& kind);

}  // namespace plumbline
