// Which of the two files somebody wrote: a cell, or the daemon's configuration.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace plumbline {

/// Decided by the keys that only one of them has, so that a file which lacks one of its own keys is
/// still told what it lacks.
enum class FileKind { kCell, kConfiguration };

/// The kind of a text; nothing where neither shows (an empty file, no TOML).
std::optional<FileKind> FileKindOf(std::string_view text);

/// What to tell who gave a configuration where a cell belongs; names the cell of the configuration.
std::string ConfigurationInsteadOfCell(std::string_view text);

}  // namespace plumbline
