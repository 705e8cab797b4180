#include "app/cell/daemon/boot_counter.h"

#include <fmt/format.h>

#include <charconv>
#include <filesystem>
#include <fstream>

#include "drivers/files/replace_file.h"

namespace plumbline::cell {
namespace {

std::string CounterFile(const std::string& directory) {
  return directory + "/boot_count";
}

}  // namespace

std::uint16_t NextBootCount(const std::string& directory) {
  std::uint16_t count = 0;
  std::string text;
  if (std::ifstream file(CounterFile(directory)); std::getline(file, text)) {
    std::from_chars(text.data(), text.data() + text.size(), count);
  }
  return ++count;
}

Result<void> StoreBootCount(const std::string& directory, std::uint16_t count) {
  std::error_code ignored;  // reported below by the file that cannot be created
  std::filesystem::create_directories(directory, ignored);
  return files::ReplaceFileDurably(CounterFile(directory), fmt::format("{}\n", count));
}

}  // namespace plumbline::cell
