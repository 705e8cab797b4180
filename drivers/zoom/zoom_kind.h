// Descriptor of a zoom sensor kind. Each kind defines one in its own source file.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "drivers/zoom/zoom.h"
#include "firmware-like/result.h"

namespace plumbline::zoom {

struct ZoomConnection;

inline constexpr double kSecondPerMs = 1e-3;  ///< ZoomOption::to_si of a key in ms

/// Name of a file that the configuration reader opens itself; the key is only documented here.
struct FileOption {};
using TextOption = std::string& (*)(ZoomConnection&);
using NumberOption = double& (*)(ZoomConnection&);
using IntegerOption = int& (*)(ZoomConnection&);
using FlagOption = bool& (*)(ZoomConnection&);

struct ZoomOption {
  std::string_view key;  ///< with its unit, as in plumbline.toml
  /// Type of the value and the member of ZoomConnection that holds it; the initial value of that
  /// member is the default.
  std::variant<FileOption, TextOption, NumberOption, IntegerOption, FlagOption> value;
  double min = 0, max = 0;  ///< range of a number, in the unit of the file
  double to_si = 1;         ///< conversion factor from that unit
  /// Empty if a kind that is registered earlier documents the same key.
  std::string_view description = {};
  std::string_view example = {};       ///< TOML value shown instead of the default
  std::string_view default_text = {};  ///< the default in words, if it is not a constant
  /// The kind cannot work without the key; for a text: unless a value is already stored.
  bool required = false;
  bool camera_device = false;  ///< the default is the device of the camera
  /// What is wrong with a value inside the range, for example "is not 9600 or 38400"; empty if
  /// nothing is. Null if every value inside the range is allowed.
  std::string (*fault)(ZoomConnection&) = nullptr;
};

struct ZoomKind {
  std::string_view name;  ///< as in the configuration
  /// Creates a sensor. It is not connected yet; its first Read() connects.
  Result<std::unique_ptr<ZoomSensor>> (*make)(const ZoomConnection&) = nullptr;
  /// Identifies the physical sensor: equal identities are the same sensor. Empty for a recording.
  std::string (*identity)(const ZoomConnection&) = nullptr;
  /// Device file that will be opened, or why there is none; empty if it is not known in advance.
  Result<std::string> (*device)(const ZoomConnection&) = nullptr;
  /// True if the sensor is reached through the network: there is no device file, only an answer
  /// shows that it is there. Null if it never is.
  bool (*in_network)(const ZoomConnection&) = nullptr;
  /// Remedy if that file is missing or cannot be opened.
  const char* remedy = "";
  double period_s = kZoomPeriod_s;  ///< reading period, unless configured
  /// Keys of the table [zoom]. Kinds may share a key; it then has the same type and range.
  std::span<const ZoomOption> options = {};
};

}  // namespace plumbline::zoom
