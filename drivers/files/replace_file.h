// Atomic replacement of whole files.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "firmware-like/result.h"

namespace plumbline::files {

/// Writes `content` to a temporary file beside `path`, syncs it and renames it to `path`. At any
/// moment `path` has its complete old content (or does not exist) or its complete new one; the last
/// of several simultaneous writers wins. A symbolic link of that name is replaced, not followed, so
/// that a user with write access to the folder cannot redirect a write made as root.
/// @return  the reason on failure ("Permission denied")
Result<void> ReplaceFile(const std::string& path, std::string_view content);

struct NewFile {
  std::string path, content;
};
/// Several files that belong together: all are written and synced before the first is renamed, so
/// that a full disk or a missing permission leaves every one as it is.
/// @return  path and reason on failure ("a.src: Permission denied")
Result<void> ReplaceFiles(std::span<const NewFile> files);

/// The same for a file of the state directory, which must survive a power cut: the folder is synced
/// too, and the next write removes what an interrupted one has left behind. The caller holds a
/// lock, or is otherwise the only writer of `path`.
/// @param mode  permissions before the umask; 0444 for files that are never modified
/// @return      path, reason and remedy on failure
Result<void> ReplaceFileDurably(const std::string& path, std::string_view content,
                                unsigned mode = 0644);

}  // namespace plumbline::files
