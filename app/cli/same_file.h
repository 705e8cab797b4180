// Comparison of paths, to keep an output from overwriting an input.
#pragma once

#include <iosfwd>
#include <string>
#include <utility>
#include <vector>

namespace plumbline::cli {

/// True if both paths refer to the same file, whether it exists or not.
bool SameFile(const std::string& one, const std::string& other);

/// Options that name a file to be written, and their paths; empty or "-": no file.
using OutputPaths = std::vector<std::pair<const char*, std::string>>;

/// Prints every output that would overwrite an input or another output; devices such as /dev/null
/// may be given several times.
/// @return  true if there is one
bool OverwritesFile(const char* command, const OutputPaths& outputs,
                    std::vector<std::string> inputs, std::ostream& err);

}  // namespace plumbline::cli
