#include "app/cli/output_file.h"

#include <fmt/format.h>

#include <filesystem>
#include <iostream>
#include <ostream>

#include "app/base/terminal/terminal_output.h"
#include "drivers/files/text_file.h"

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

std::string UnwritableText(const std::string& path, const std::string& why,
                           std::string_view option) {
  return fmt::format("{}: cannot be written: {}; choose another {}\n", path, why, option);
}

bool CanWriteOutput(const std::string& path, std::string_view option) {
  const Result<void> writable = files::CheckWritable(path);
  if (!writable) std::cerr << UnwritableText(path, writable.error(), option);
  return writable.ok();
}

bool WriteOutput(const std::string& path, std::string_view text, std::string_view option) {
  const Result<void> written = files::WriteTextFile(path, text);
  if (!written) std::cerr << UnwritableText(path, written.error(), option);
  return written.ok();
}

bool PrintOrWriteOutput(const std::string& path, std::string_view text, std::string_view option) {
  if (path != "-") return WriteOutput(path, text, option);
  terminal::PrintExactly(std::cout, text);
  return true;
}

}  // namespace plumbline::cli
