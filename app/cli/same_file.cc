#include "app/cli/same_file.h"

#include <filesystem>

namespace plumbline {

bool SameFile(const std::string& one, const std::string& other) {
  namespace fs = std::filesystem;
  if (one.empty() || other.empty()) return false;
  std::error_code missing;
  if (fs::equivalent(one, other, missing)) return true;  // links, hard ones too
  // A new file's name stays relative in weakly_canonical: "a.x" and "./a.x" would be two.
  return fs::weakly_canonical(fs::absolute(one, missing), missing) ==
         fs::weakly_canonical(fs::absolute(other, missing), missing);
}

}  // namespace plumbline
