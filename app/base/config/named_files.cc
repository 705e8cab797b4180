#include "app/base/config/named_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace plumbline::config {

namespace {

/// "; supplied are kr210, ur5": the files of an installed folder; empty if there is none.
std::string SuppliedText(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(folder, none)) {
    if (entry.path().extension() == ".toml") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names.empty() ? "" : fmt::format("; supplied are {}", fmt::join(names, ", "));
}

}  // namespace

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
  const std::string supplied = folder.empty() ? "" : SuppliedText(data_directory_ / folder);
  table.AddFault(key, fmt::format("cannot be read ({}); check the name, or copy the file there{}",
                                  reason, supplied));
  return std::nullopt;
}

}  // namespace plumbline::config
