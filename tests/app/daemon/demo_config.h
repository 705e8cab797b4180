// The demo's configuration for a daemon beside a running virtual cell.
#pragma once

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace plumbline::test {

/// Replaces the whole line that begins with `key = `, the first one below `section`.
inline std::string WithLine(std::string text, const std::string& section, const std::string& key,
                            const std::string& value) {
  const auto from = section.empty() ? 0 : text.find("[" + section + "]");
  const auto at = text.find("\n" + key + " = ", from) + 1;
  return text.replace(at, text.find('\n', at) - at, key + " = " + value);
}

/// @param robot    "HOST:PORT" of the controller
/// @param profile  name in config/profiles
inline std::string DemoConfig(const std::string& robot, const std::string& profile) {
  std::ifstream file("tests/virtual_cell/demo/plumbline.toml");
  std::stringstream stream;
  stream << file.rdbuf();
  std::string text = stream.str();
  const std::string here = std::filesystem::current_path().string();
  const auto quoted = [](const std::string& path) { return "\"" + path + "\""; };
  text = WithLine(text, "", "cell", quoted(here + "/tests/virtual_cell/demo/cockpit-cell.toml"));
  text = WithLine(text, "robot", "profile", quoted(here + "/config/profiles/" + profile + ".toml"));
  text = WithLine(text, "robot", "port", robot.substr(robot.find(':') + 1));
  return WithLine(text, "plc", "port", "0");
}

}  // namespace plumbline::test
