// Supervision of the state directory: full, read-only, or in use by another daemon.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "app/base/log/log_entry.h"
#include "app/cell/model_store/daemon_signal.h"
#include "firmware-like/result.h"

namespace plumbline::cell {

// Counter of the daemon's starts in a file that survives a power cut.

/// The number of this start: one more than the count in `directory`/boot_count. 1 if the file is
/// missing or holds no number. Changes nothing on disk.
std::uint16_t NextBootCount(const std::string& directory);

/// Stores the count, once the start has succeeded: write, fsync, rename, fsync of the folder, so
/// that a power cut leaves the old number or the new one. @return  why it could not be stored
Result<void> StoreBootCount(const std::string& directory, std::uint16_t count);

/// Why no file can be written and synced in `directory` now, with a remedy; nullopt if one can.
/// Creates the directory if it is missing. Blocks on the disk.
std::optional<std::string> StorageFault(const std::string& directory);

/// Monitors whether the state directory is writable, and locks it for this daemon: two daemons that
/// write one journal would each treat the other's probes as drift. Corrections do not depend on it:
/// points are served without storage, only probes and models need it. If the boot counter could not
/// be stored at start-up, it is stored as soon as the directory is writable.
///
/// Call Acquire() and StoreBootCount() first; after that Check() and Poll() from one thread,
/// writable() from any.
class StateStorage {
 public:
  StateStorage(std::string directory, log::LogSink sink);

  /// Locks the directory for this daemon. If the disk cannot be written, that is logged and checked
  /// again later.
  /// @return  why this daemon must not write there: another one uses the directory
  std::optional<std::string> Acquire();
  /// Stores the number of this start, now or as soon as the directory is writable.
  void StoreBootCount(std::uint16_t count);
  /// Sets the callback by which Check() reports that the directory is writable again.
  void OnWritable(std::function<void()> callback) { on_writable_ = std::move(callback); }

  /// Tries to write, and logs changes.
  /// @return  whether this daemon may write there now
  bool Check();
  /// Checks again if the directory was not writable, or if its file system reports that it is full,
  /// out of inodes or read-only. To be called every few seconds.
  /// @return  whether the directory has become writable since the last call
  bool Poll();
  bool writable() const { return writable_; }

 private:
  std::optional<std::string> Try();

  const std::string directory_;
  const log::LogSink sink_;
  std::optional<StateDirectoryLock> lock_;
  std::optional<std::uint16_t> boot_count_;  ///< not stored yet
  std::string fault_;                        ///< logged; empty: none
  std::function<void()> on_writable_;
  std::atomic<bool> writable_{false};
};

}  // namespace plumbline::cell
