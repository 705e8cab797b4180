#include "app/config/named_files.h"

#include <fmt/format.h>

namespace plumbline::config {

std::optional<std::pair<std::string, std::string>> NamedFiles::Read(
    const TomlTable& table, std::string_view key, const std::string& folder) const {
  const auto name = table.RequiredString(key);
  if (!name) return std::nullopt;
  std::filesystem::path path(*name);
  if (!folder.empty() && !path.has_extension() && !path.has_parent_path()) {
    path = std::filesystem::path(folder) / (*name + ".toml");
  }
  std::string reason;
  for (const std::filesystem::path& directory : {config_directory_, data_directory_}) {
    const std::string candidate = (directory / path).lexically_normal().string();
    Result<std::string> text = files_(candidate);
    if (text) return std::pair(candidate, std::move(text).value());
    reason += fmt::format("{}{}: {}", reason.empty() ? "" : "; ", candidate, text.error());
    if (path.is_absolute()) break;
  }
  table.AddFault(
      key, fmt::format("cannot be read ({}); check the name, or copy the file there", reason));
  return std::nullopt;
}

}  // namespace plumbline::config
