// Error messages with reason and remedy for files and devices that cannot be opened.
#pragma once

#include <string>
#include <string_view>

namespace plumbline::files {

/// Remedy for a file or folder that cannot be read, derived from what exists at `path` now: it
/// names a missing folder, the owner of an inaccessible one, or the group that grants access. It is
/// meant to be appended to a reason: "; check the name: ls /etc/plumbline". Empty if no cause is
/// found.
std::string ReadRemedy(const std::string& path);

/// The same for a file that cannot be written; also considers the file system.
std::string WriteRemedy(const std::string& path);

/// "cannot be read: No such file or directory; check the name: ls /etc/plumbline".
/// @param reason  the system's reason, without a remedy ("No such file or directory")
std::string ReadErrorText(const std::string& path, std::string_view reason);

/// "cannot be written: Permission denied; ...".
std::string WriteErrorText(const std::string& path, std::string_view reason);

/// A kind of device, with the remedies if such a device cannot be opened.
struct DeviceKind {
  const char* group;      ///< whose members may open it on Debian; empty: only root
  const char* if_absent;  ///< what to check if it does not exist
  const char* if_wrong;   ///< what to check if the path is another kind of file
};

inline constexpr DeviceKind kSerialLine{
    "dialout", "is the adapter plugged in, and is this its name (ls /dev/serial/by-id)?",
    "it is not a serial line"};
inline constexpr DeviceKind kCameraDevice{"video", "is the camera plugged in (plumbline cameras)?",
                                          "it is not a camera"};
inline constexpr DeviceKind kDisplayDevice{
    "video", "there is no such device: ls /dev/dri /dev/fb*, set device of [overlay]",
    "it is not a display"};
inline constexpr DeviceKind kGpioChip{"plumbline", "check `chip` with gpiodetect",
                                      "check `chip` with gpiodetect"};

/// "cannot be opened: Permission denied; user maria must be in the group dialout: ...".
/// @param error  errno of the attempt
std::string OpenErrorText(int error, const DeviceKind& kind);

}  // namespace plumbline::files
