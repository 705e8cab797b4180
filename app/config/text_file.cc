#include "app/config/text_file.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

namespace plumbline {

Result<std::string> ReadTextFile(const std::string& path) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"),
                                                             &std::fclose);
  if (!file) return Error{std::strerror(errno)};
  std::string text;
  char buffer[65536];
  while (true) {
    const std::size_t count = std::fread(buffer, 1, sizeof buffer, file.get());
    text.append(buffer, count);
    if (text.size() > kLargestTextFile) return Error{"larger than 256 MiB"};
    if (count == sizeof buffer) continue;
    if (std::ferror(file.get()) != 0) return Error{std::strerror(errno)};
    return text;
  }
}

}  // namespace plumbline
