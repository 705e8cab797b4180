// The state directory as something that can fail: full, read-only, not ours.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "app/log/log_entry.h"
#include "app/model_store/daemon_signal.h"

namespace plumbline {

/// What keeps a file from being written and synced in `directory` now, with what to do about it;
/// nothing where it works. Makes the directory where there is none. Waits for the disk.
std::optional<std::string> WhyNotStorable(const std::string& directory);

/// Watches whether the state directory can be written, and takes it for this daemon: two daemons
/// that write one journal would alarm for each other. Nothing of the correction depends on it:
/// points are served without storage, only probes and models need it. What could not be kept at
/// the start is kept once the directory works.
///
/// Take() and KeepBootCount() first; after that Check() and Watch() from one thread, works() from
/// any.
class StateStorage {
 public:
  StateStorage(std::string directory, LogSink sink);

  /// Takes the directory. A disk that cannot be written is logged, and checked again later.
  /// @return  why this daemon must not write there: another one does
  std::optional<std::string> Take();
  /// The number of this start, to be kept as soon as the directory works.
  void KeepBootCount(std::uint16_t count);
  /// Called by Check() when the directory works again.
  void OnWorks(std::function<void()> works) { on_works_ = std::move(works); }

  /// Tries to write there, and logs where that has changed.
  /// @return  whether this daemon may write there now
  bool Check();
  /// Every few seconds: checks again where the directory did not work, and where its file system
  /// has become full, out of inodes or read-only. @return whether it works again since the last
  /// call
  bool Watch();
  bool works() const { return works_; }

 private:
  std::optional<std::string> Try();

  const std::string directory_;
  const LogSink sink_;
  std::optional<DaemonMark> mark_;
  std::optional<std::uint16_t> boot_count_;  ///< not kept yet
  std::string fault_;                        ///< logged; empty: none
  std::function<void()> on_works_;
  std::atomic<bool> works_{false};
};

}  // namespace plumbline
