// The object table while it runs: read again when somebody saves it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "app/config/fault.h"
#include "app/scene/object_table.h"

namespace plumbline {

/// What tells one state of a file from another.
struct FileStamp {
  std::int64_t changed_ns = 0;
  std::uint64_t bytes = 0, inode = 0;
  bool there = false;

  bool operator==(const FileStamp&) const = default;
};

/// Of the object table, and of mesh files, which may be saved anew as well.
FileStamp StampOfFile(const std::string& path);

/// What reading the table again brought.
struct TableNews {
  bool accepted = false;  ///< false: it has faults, and the table before stays in force
  FaultList faults;       ///< warnings too
};

class ObjectTableFile {
 public:
  /// @param tags  must outlive this; null: tags and bodies are not checked
  ObjectTableFile(std::string path, const TagDatabase* tags)
      : path_(std::move(path)), tags_(tags) {}

  /// Looks whether the file was changed, and reads it once it stands still from one look to the
  /// next, so that a half-saved file is not told as faulty; at the first look at once. Looks once
  /// or twice a second serve.
  std::optional<TableNews> Look();

  /// In force; nothing until one was accepted.
  const std::optional<ObjectTable>& table() const { return table_; }

 private:
  const std::string path_;
  const TagDatabase* const tags_;
  std::optional<ObjectTable> table_;
  std::optional<FileStamp> read_, seen_;
};

}  // namespace plumbline
