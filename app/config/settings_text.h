// The configuration table as documents.
#pragma once

#include <string>

namespace plumbline {

/// config/plumbline.toml: the lines that a first cell edits, and all others commented out.
std::string SettingsToml();
/// The reference of plumbline.toml in MANUAL.md.
std::string SettingsMarkdown();
/// The manual page plumbline.toml(5).
std::string SettingsManPage();

}  // namespace plumbline
