#include "app/config/program_beside.h"

#include <filesystem>

namespace plumbline {

std::string OwnFolder() {
  std::error_code error;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
  return error ? "/usr/bin" : self.parent_path().string();
}

}  // namespace plumbline
