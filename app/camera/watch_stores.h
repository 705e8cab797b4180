// What the watches of all cameras keep in one place: lenses and marks.
#pragma once

#include <mutex>
#include <optional>
#include <string>

#include "app/camera/marks_store.h"
#include "app/camera/watch_core.h"
#include "app/lens_store/lens_store.h"

namespace plumbline {

/// The lens store: opened when it is first asked, and again, at most every kRetry_s, after it
/// failed. One connection for all cameras: where a damaged file is replaced by its backup, nobody
/// goes on with the old one. Any thread; whoever asks waits for the disk.
class LensShelf {
 public:
  static constexpr double kRetry_s = 5;

  /// @param sink  gets what a person should know of the opening
  LensShelf(std::string path, LogSink sink) : path_(std::move(path)), sink_(std::move(sink)) {}

  Result<std::optional<LensFound>> Find(const LensKey& key, const LensTolerance& tolerance);
  Result<std::int64_t> Append(const LensEntry& entry);

 private:
  bool Open();

  const std::string path_;
  const LogSink sink_;
  std::mutex mutex_;
  std::optional<LensStore> store_;
  double tried_s_ = -1e300;
  std::string problem_;  ///< of the last attempt that failed
};

struct WatchStores {
  /// @param cell  the fixed marks
  WatchStores(const std::string& state_directory, const Body& cell, const LogSink& sink);

  LensShelf lenses;
  std::string marks_problem;  ///< what was wrong with their file; told
  MarksStore marks;
};

}  // namespace plumbline
