// Numbers of printed sheets as text.
#pragma once

#include <fmt/format.h>

#include <string>

namespace plumbline::vision {

/// Millimetres as a TOML float: "80.0", "36.25".
inline std::string TomlMm(double mm) {
  std::string text = fmt::format("{:.6g}", mm);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

}  // namespace plumbline::vision
