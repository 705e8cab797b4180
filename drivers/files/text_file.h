// Reading and atomic writing of whole text files.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "firmware-like/result.h"

namespace plumbline::files {

/// Larger files are refused: no configuration or table of a cell is that large.
inline constexpr std::size_t kMaxTextFileBytes = std::size_t{256} << 20;

/// Reads a file, or a pipe to its end.
/// @return the content, or the reason why it cannot be read ("No such file or directory"); a pipe
///         that delivers nothing for 1.5 s is an error
Result<std::string> ReadTextFile(const std::string& path);

/// Replaces a file atomically (`files::ReplaceFile`), but follows a symbolic link. Special files,
/// and /dev/stdout in any case, are written to directly.
/// @return the reason on failure ("Permission denied")
Result<void> WriteTextFile(const std::string& path, std::string_view text);

/// Checks that the file could be written now; changes nothing.
/// @return  the reason if not ("Permission denied")
Result<void> CheckWritable(const std::string& path);

}  // namespace plumbline::files
