// Whether an output would destroy an input.
#pragma once

#include <string>

namespace plumbline {

/// True where both names lead to the same file, be it there or yet to be made.
bool SameFile(const std::string& one, const std::string& other);

}  // namespace plumbline
