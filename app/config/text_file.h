// A whole text file, read and written.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "firmware-like/result.h"

namespace plumbline {

/// Files beyond this are refused: no configuration or table of a cell is that large.
inline constexpr std::size_t kLargestTextFile = std::size_t{256} << 20;

/// The content of a file, or why it cannot be read ("No such file or directory"). A pipe is read to
/// its end; one into which nothing comes for 1.5 s is an error.
Result<std::string> ReadTextFile(const std::string& path);

/// Puts text under that name so that the name never stands for half of it: written beside it,
/// synced, renamed. A link is followed; what is no regular file is written to, as /dev/stdout
/// always is.
/// @return or why not ("Permission denied")
Result<void> WriteTextFile(const std::string& path, std::string_view text);

/// The same for a file that a program of ours keeps in its state directory: no link is followed,
/// one of that name is replaced. Whoever may write there must not have it write elsewhere as root.
Result<void> WriteStateFile(const std::string& path, std::string_view text);

/// Why a file of that name could not be written now; nothing where it could. Changes nothing.
[[nodiscard]] std::optional<Error> WhyNotWritable(const std::string& path);

}  // namespace plumbline
