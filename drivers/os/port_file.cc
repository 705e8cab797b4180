#include "drivers/os/port_file.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "drivers/os/descriptor.h"
#include "drivers/os/file_writing.h"

namespace plumbline::os {

Result<void> WritePortFile(const std::string& path, const std::vector<NamedPort>& ports) {
  std::string text;
  for (const NamedPort& one : ports) text += fmt::format("{} {}\n", one.name, one.port);
  const std::string unfinished = path + ".tmp";
  const Descriptor file(
      open(unfinished.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0644));
  if (file && WriteAll(file.get(), text) && std::rename(unfinished.c_str(), path.c_str()) == 0) {
    return {};
  }
  return Error{fmt::format(
      "{}: the port cannot be written there: {}; name a file in a folder that exists and that this "
      "program may write",
      path, std::strerror(errno))};
}

}  // namespace plumbline::os
