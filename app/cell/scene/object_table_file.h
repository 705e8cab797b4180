// Object table file, reloaded when it changes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "app/base/config/fault.h"
#include "app/cell/scene/object_table.h"

namespace plumbline::cell {

/// Fingerprint of a file, to detect changes.
struct FileStamp {
  std::int64_t changed_ns = 0;
  std::uint64_t bytes = 0, inode = 0;
  bool there = false;  ///< the file exists

  bool operator==(const FileStamp&) const = default;
};

FileStamp StampOfFile(const std::string& path);

/// Result of reading the table again.
struct ObjectTableUpdate {
  bool accepted = false;     ///< if false, it has faults, and the previous table stays in use
  config::FaultList faults;  ///< including warnings
};

class ObjectTableFile {
 public:
  /// @param tags  must outlive this object; if null, tags and bodies are not checked
  ObjectTableFile(std::string path, const target::TagDatabase* tags)
      : path_(std::move(path)), tags_(tags) {}

  /// Checks the file for changes. A changed file is read once it is unchanged between two calls, so
  /// that a partially saved file is not reported as faulty; the first call reads at once. Call it
  /// once or twice a second.
  /// @return  nullopt if nothing was read
  std::optional<ObjectTableUpdate> Poll();

  /// The table in use; nullopt until one was accepted.
  const std::optional<ObjectTable>& table() const { return table_; }

 private:
  const std::string path_;
  const target::TagDatabase* const tags_;
  std::optional<ObjectTable> table_;
  std::optional<FileStamp> read_, seen_;
};

}  // namespace plumbline::cell
