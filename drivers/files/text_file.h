// Reading and atomic writing of whole text files.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "firmware-like/result.h"

namespace plumbline::files {

/// Largest size of a kind of file. A larger one is refused before it is read, or at the limit if
/// its size is not known before.
struct SizeLimit {
  std::size_t bytes;
  const char* kind;    ///< "a configuration file"
  const char* remedy;  ///< for one that is too large
};
/// The largest configuration file of a cell with 1000 points has about 250 kB.
inline constexpr SizeLimit kConfigurationSize{
    1'000'000, "a configuration file",
    "Check that this is the right file, and that no program has appended to it"};
/// Measured points, recordings and reports: about 400,000 rows.
inline constexpr SizeLimit kTableSize{128'000'000, "a table or report",
                                      "Check the name, or split the file"};

/// Reads a file, or a pipe to its end.
/// @return the content, or the reason why it cannot be read ("No such file or directory"); a pipe
///         that delivers nothing for 1.5 s is an error
Result<std::string> ReadFileUpTo(const SizeLimit& limit, const std::string& path);
/// Reads a configuration file, within kConfigurationSize.
Result<std::string> ReadTextFile(const std::string& path);

/// Replaces a file atomically (`files::ReplaceFile`), but follows a symbolic link. Special files,
/// and /dev/stdout in any case, are written to directly.
/// @return the reason on failure ("Permission denied")
Result<void> WriteTextFile(const std::string& path, std::string_view text);

/// Checks that the file could be written now; changes nothing.
/// @return  the reason if not ("Permission denied")
Result<void> CheckWritable(const std::string& path);

}  // namespace plumbline::files
