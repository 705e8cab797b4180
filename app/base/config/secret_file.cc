#include "app/base/config/secret_file.h"

#include <fmt/format.h>
#include <sys/stat.h>

namespace plumbline::config {

std::optional<std::string> WhyExposed(const std::string& file) {
  struct stat about {};
  if (stat(file.c_str(), &about) != 0 || (about.st_mode & S_IROTH) == 0) return std::nullopt;
  return fmt::format("is readable by every user of this computer; restrict it: chmod o-r {}", file);
}

}  // namespace plumbline::config
