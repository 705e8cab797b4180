#include "app/cli/same_file.h"

#include <fmt/format.h>

#include <filesystem>
#include <ostream>

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

bool OverwritesFile(const char* command, const OutputPaths& outputs,
                    std::vector<std::string> inputs, std::ostream& err) {
  namespace fs = std::filesystem;
  bool overwrites = false;
  for (const auto& [option, path] : outputs) {
    std::error_code unknown;
    const bool special = fs::exists(path, unknown) && !fs::is_regular_file(path, unknown);
    if (path.empty() || path == "-" || special) continue;
    for (const std::string& other : inputs) {
      if (!SameFile(path, other)) continue;
      err << fmt::format("plumbline {}: {} would overwrite {}; choose another file\n", command,
                         option, other);
      overwrites = true;
    }
    inputs.push_back(path);
  }
  return overwrites;
}

}  // namespace plumbline::cli
