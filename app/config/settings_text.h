// Documents generated from the configuration table.
#pragma once

#include <string>

namespace plumbline::config {

/// config/plumbline.toml: the lines to edit for a first cell; all others commented out.
std::string SettingsToml();
/// The reference of plumbline.toml in MANUAL.md, a Markdown table.
std::string SettingsMarkdown();
/// The manual page plumbline.toml(5).
std::string SettingsManPage();

}  // namespace plumbline::config
