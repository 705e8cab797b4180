#include "app/cli/same_file.h"

#include <filesystem>

namespace plumbline::cli {

bool SameFile(const std::string& one, const std::string& other) {
  namespace fs = std::filesystem;
  if (one.empty() || other.empty()) return false;
  std::error_code missing;
  if (fs::equivalent(one, other, missing)) return true;  // follows symbolic and hard links
  // weakly_canonical keeps the name of a new file relative: "a.x" and "./a.x" would differ.
  return fs::weakly_canonical(fs::absolute(one, missing), missing) ==
         fs::weakly_canonical(fs::absolute(other, missing), missing);
}

}  // namespace plumbline::cli
