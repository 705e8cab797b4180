// A whole text file in memory.
#pragma once

#include <string>

#include "firmware-like/result.h"

namespace plumbline {

/// Files beyond this are refused: no configuration or table of a cell is that large.
inline constexpr std::size_t kLargestTextFile = std::size_t{256} << 20;

/// The content of a file, or why it cannot be read ("No such file or directory").
Result<std::string> ReadTextFile(const std::string& path);

}  // namespace plumbline
