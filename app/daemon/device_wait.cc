#include "app/daemon/device_wait.h"

#include <fmt/format.h>

#include <fstream>
#include <string>

namespace plumbline {

bool WaitsForDevice(pid_t thread) {
  std::ifstream stat(fmt::format("/proc/self/task/{}/stat", thread));
  std::string line;
  std::getline(stat, line);
  // Its name stands in parentheses and may hold any character; the state comes after it.
  const auto name_end = line.rfind(") ");
  return name_end != std::string::npos && line.compare(name_end + 2, 2, "D ") == 0;
}

}  // namespace plumbline
