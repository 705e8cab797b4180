// Which of the files somebody wrote: a cell, or the daemon's configuration.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace plumbline {

/// Or a profile of a controller or a lens, which a configuration names. Decided by the keys that
/// only one of them has, so that a file which lacks one of its own keys is still told what it
/// lacks.
enum class FileKind { kCell, kConfiguration, kProfile };

/// The kind of a text; nothing where neither shows (an empty file, no TOML).
std::optional<FileKind> FileKindOf(std::string_view text);

/// Why a text is plainly no cell: what it is instead, and what to give. Nothing where it may be
/// one.
std::optional<std::string> WhyNoCell(std::string_view text);

}  // namespace plumbline
