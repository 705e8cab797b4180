// The demo's configuration for a daemon beside a running virtual cell.
#pragma once

#include <filesystem>
#include <string>

#include "tests/file_text.h"

namespace plumbline::test {

/// Replaces the whole line that begins with `key = `, the first one below `section`.
inline std::string WithLine(std::string text, const std::string& section, const std::string& key,
                            const std::string& value) {
  const auto from = section.empty() ? 0 : text.find("[" + section + "]");
  const auto at = text.find("\n" + key + " = ", from) + 1;
  return text.replace(at, text.find('\n', at) - at, key + " = " + value);
}

/// Without the demo's [monitoring]: a test adds its own.
/// @param robot    "HOST:PORT" of the controller
/// @param profile  name in config/profiles
inline std::string DemoConfig(const std::string& robot, const std::string& profile) {
  std::string text = FileText("tests/virtual_cell/demo/plumbline.toml");
  const auto loop = text.find("[monitoring]");
  text.erase(loop, text.find("\n[", loop) + 1 - loop);
  const std::string here = std::filesystem::current_path().string();
  const auto quoted = [](const std::string& path) { return "\"" + path + "\""; };
  text = WithLine(text, "", "cell", quoted(here + "/tests/virtual_cell/demo/cockpit-cell.toml"));
  text = WithLine(text, "", "state_directory", quoted("state"));
  text = WithLine(text, "robot", "profile", quoted(here + "/config/profiles/" + profile + ".toml"));
  text = WithLine(text, "robot", "port", robot.substr(robot.find(':') + 1));
  return WithLine(text, "plc", "port", "0");
}

/// The same with input of the robot that may be five seconds old: on a busy computer, and under a
/// sanitizer, more than the demonstration's 200 ms pass between two answers.
inline std::string PatientConfig(const std::string& robot, const std::string& profile) {
  return WithLine(DemoConfig(robot, profile), "robot", "stale_after_ms", "5000");
}

}  // namespace plumbline::test
