#include "app/cli/same_file.h"

#include <filesystem>

namespace plumbline {

bool SameFile(const std::string& one, const std::string& other) {
  namespace fs = std::filesystem;
  if (one.empty() || other.empty()) return false;
  std::error_code missing;
  if (fs::equivalent(one, other, missing)) return true;  // links, hard ones too
  return fs::weakly_canonical(one, missing) == fs::weakly_canonical(other, missing);
}

}  // namespace plumbline
