// Classification of a TOML file by its keys: cell, daemon configuration or profile.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace plumbline::config {

/// kProfile is the profile of a controller or a zoom lens. The kind is decided by keys that only
/// one of the kinds has, so that an incomplete file is still classified and its missing keys
/// reported.
enum class FileKind { kCell, kConfiguration, kProfile };

/// The kind of a text, or nullopt if no key decides (an empty file, not TOML).
std::optional<FileKind> FileKindOf(std::string_view text);

/// Why a text is clearly not a cell: what it is instead and which file to give. Nullopt if it may
/// be a cell.
std::optional<std::string> WhyNotACell(std::string_view text);

}  // namespace plumbline::config
