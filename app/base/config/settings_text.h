// Documents generated from the configuration table.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace plumbline::config {

/// The headers of the tables of plumbline.toml with this key, "[page]"; top-level keys have none.
std::vector<std::string> HeadersWithKey(std::string_view key);

/// config/plumbline.toml: the headers and the lines to edit for a first cell; all others are
/// commented out.
std::string SettingsToml();
/// The table of docs/reference/keys.md, in Markdown.
std::string SettingsMarkdown();
/// The manual page plumbline.toml(5).
std::string SettingsManPage();

}  // namespace plumbline::config
