// Comparison of paths, to keep an output from overwriting an input.
#pragma once

#include <string>

namespace plumbline::cli {

/// True if both paths refer to the same file, whether it exists or not.
bool SameFile(const std::string& one, const std::string& other);

}  // namespace plumbline::cli
