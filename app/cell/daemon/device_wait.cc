#include "app/cell/daemon/device_wait.h"

#include <fmt/format.h>

#include <fstream>
#include <string>

namespace plumbline::cell {

bool IsWaitingForDevice(pid_t thread) {
  std::ifstream stat(fmt::format("/proc/self/task/{}/stat", thread));
  std::string line;
  std::getline(stat, line);
  // The state follows the thread name, which is in parentheses and may contain any character.
  const auto name_end = line.rfind(") ");
  return name_end != std::string::npos && line.compare(name_end + 2, 2, "D ") == 0;
}

}  // namespace plumbline::cell
