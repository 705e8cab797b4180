// Resolver of the files that a configuration refers to.
//
// A relative path is resolved in the directory of the configuration, then in the installed data
// directory.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "app/base/config/daemon_config_reader.h"
#include "app/base/config/toml_reader.h"

namespace plumbline::config {

class NamedFiles {
 public:
  NamedFiles(const std::string& config_file, const FileSource& files, std::string data_directory)
      : config_directory_(std::filesystem::path(config_file).parent_path()),
        data_directory_(std::move(data_directory)),
        files_(files) {}

  /// Path and content of the file named by `key`; adds a fault at the key if it cannot be read.
  /// @param folder  a bare name without suffix means FOLDER/NAME.toml; if empty, every name is a
  ///                path
  std::optional<std::pair<std::string, std::string>> Read(const TomlTable& table,
                                                          std::string_view key,
                                                          const std::string& folder) const;

  /// Read() if the file is needed; otherwise only checks that the key, if present, is a string.
  std::optional<std::pair<std::string, std::string>> ReadIf(bool needed, const TomlTable& table,
                                                            std::string_view key,
                                                            const std::string& folder) const {
    if (needed) return Read(table, key, folder);
    static_cast<void>(table.String(key));
    return std::nullopt;
  }

  /// Returns an absolute path unchanged and resolves a relative one in the configuration's
  /// directory.
  std::string Resolve(const std::string& path) const {
    return (config_directory_ / path).lexically_normal().string();
  }

 private:
  std::filesystem::path config_directory_, data_directory_;
  const FileSource& files_;
};

}  // namespace plumbline::config
