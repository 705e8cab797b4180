// Stores shared by the supervisors of all cameras: lenses and reference-tag baselines.
#pragma once

#include <mutex>
#include <optional>
#include <string>

#include "app/vision/camera/lens_supervisor.h"
#include "app/vision/camera/tag_baseline_store.h"
#include "app/vision/lens_store/lens_store.h"

namespace plumbline::vision {

/// Thread-safe lens store that is opened on first use and, after a failure, reopened at most every
/// kRetryInterval_s. All cameras share one connection, so that no camera keeps a damaged file open
/// after it has been replaced by its backup. Callers block on disk access.
class SharedLensStore {
 public:
  static constexpr double kRetryInterval_s = 5;

  /// @param sink  receives a message if opening had to repair or replace the file
  SharedLensStore(std::string path, log::LogSink sink)
      : path_(std::move(path)), sink_(std::move(sink)) {}

  Result<std::optional<LensFound>> Find(const LensKey& key, const LensTolerance& tolerance,
                                        const target::DeclaredFacts& declared);
  /// See LensStore::Withheld(). For the log only: nullopt if the store cannot be read.
  std::optional<LensEntry> Withheld(const LensKey& key, const LensTolerance& tolerance,
                                    const target::DeclaredFacts& declared);
  Result<std::int64_t> Append(const LensEntry& entry);

 private:
  bool Open();

  const std::string path_;
  const log::LogSink sink_;
  std::mutex mutex_;
  std::optional<LensStore> store_;
  double last_attempt_s_ = -1e300;
  std::string problem_;  ///< of the last failed attempt
};

struct CameraStores {
  /// Logs if the baseline file cannot be read.
  /// @param cell  the reference tags
  CameraStores(const std::string& state_directory, const target::Body& cell,
               const log::LogSink& sink);

  SharedLensStore lenses;
  std::string baselines_problem;  ///< why the baseline file could not be read; empty if it could
  TagBaselineStore baselines;
};

}  // namespace plumbline::vision
