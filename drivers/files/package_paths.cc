#include "drivers/files/package_paths.h"

#include <cstdlib>
#include <filesystem>

namespace plumbline::files {

std::string ProgramFolder() {
  std::error_code error;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
  return error ? "/usr/bin" : self.parent_path().string();
}

std::string PlumblineProgram() {
  if (const char* named = std::getenv("PLUMBLINE_PROGRAM")) return named;
  return SiblingProgram("plumbline");
}

std::string SiblingModule(const std::string& name) {
  const std::filesystem::path prefix = std::filesystem::path(ProgramFolder()).parent_path();
  return (prefix / "lib/plumbline" / name).string();
}

}  // namespace plumbline::files
