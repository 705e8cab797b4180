// Description of one configuration key of a zoom sensor kind: where its value is stored, its range
// and its documentation.
#pragma once

#include <string>
#include <string_view>
#include <variant>

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
  std::string_view (*fault)(ZoomConnection&) = nullptr;
};

}  // namespace plumbline::zoom
