// The files that a configuration names: found beside it, or in the installed data directory.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "app/config/daemon_config_reader.h"
#include "app/config/toml_reader.h"

namespace plumbline {

class NamedFiles {
 public:
  NamedFiles(const std::string& config_file, const FileSource& files, std::string data_directory)
      : beside_(std::filesystem::path(config_file).parent_path()),
        data_(std::move(data_directory)),
        files_(files) {}

  /// Path and content of the file that `key` names; a fault at the key where there is none.
  /// `folder` is where a bare name without suffix is looked for.
  std::optional<std::pair<std::string, std::string>> Read(const TomlTable& table,
                                                          std::string_view key,
                                                          const std::string& folder) const;

  /// The same if the file is needed; otherwise only checks that the key, if present, is a text.
  std::optional<std::pair<std::string, std::string>> ReadIf(bool needed, const TomlTable& table,
                                                            std::string_view key,
                                                            const std::string& folder) const {
    if (needed) return Read(table, key, folder);
    static_cast<void>(table.String(key));
    return std::nullopt;
  }

  std::string Beside(const std::string& path) const {
    return (beside_ / path).lexically_normal().string();
  }

 private:
  std::filesystem::path beside_, data_;
  const FileSource& files_;
};

}  // namespace plumbline
