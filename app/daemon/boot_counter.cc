#include "app/daemon/boot_counter.h"

#include <fmt/format.h>

#include <charconv>
#include <filesystem>
#include <fstream>

#include "app/model_store/durable_file.h"

namespace plumbline {

Result<std::uint16_t> RaiseBootCounter(const std::string& directory) {
  std::error_code ignored;  // told below, by the file that cannot be created
  std::filesystem::create_directories(directory, ignored);
  const std::string path = directory + "/boot_count";
  std::uint16_t count = 0;
  std::string text;
  if (std::ifstream file(path); std::getline(file, text)) {
    std::from_chars(text.data(), text.data() + text.size(), count);
  }
  ++count;
  const Result<bool> kept = WriteDurably(path, fmt::format("{}\n", count));
  if (!kept) return Error{kept.error()};
  return count;
}

}  // namespace plumbline
