#include "app/vision/camera/camera_stores.h"

#include "drivers/clock.h"

namespace plumbline::vision {

bool SharedLensStore::Open() {
  if (store_) return true;
  const double now_s = MonotonicSeconds();
  if (now_s - last_attempt_s_ < kRetryInterval_s) return false;
  last_attempt_s_ = now_s;
  auto opened = LensStore::Open(path_);
  if (!opened) {
    problem_ = opened.error();
    return false;
  }
  store_.emplace(std::move(opened).value());
  if (!store_->notice().empty())
    sink_({log::Event::kLensStoreRestored, "lens store: " + store_->notice()});
  return true;
}

Result<std::optional<LensFound>> SharedLensStore::Find(const LensKey& key,
                                                       const LensTolerance& tolerance,
                                                       const target::DeclaredFacts& declared) {
  const std::lock_guard lock(mutex_);
  if (!Open()) return Error{problem_};
  auto found = store_->Find(key, tolerance, declared);
  if (!found) {
    problem_ = found.error();
    store_.reset();
  }
  return found;
}

std::optional<LensEntry> SharedLensStore::Withheld(const LensKey& key,
                                                   const LensTolerance& tolerance,
                                                   const target::DeclaredFacts& declared) {
  const std::lock_guard lock(mutex_);
  if (!Open()) return std::nullopt;
  auto withheld = store_->Withheld(key, tolerance, declared);
  return withheld ? *std::move(withheld) : std::nullopt;
}

Result<std::int64_t> SharedLensStore::Append(const LensEntry& entry) {
  const std::lock_guard lock(mutex_);
  if (!store_) last_attempt_s_ = -1e300;  // a new lens is always worth an attempt
  if (!Open()) return Error{problem_};
  return store_->Append(entry);
}

CameraStores::CameraStores(const std::string& state_directory, const target::Body& cell,
                           const log::LogSink& sink)
    : lenses(state_directory + "/lenses.sqlite", sink),
      baselines(state_directory + "/fixed_marks.json", cell, baselines_problem) {
  if (!baselines_problem.empty())
    sink({log::Event::kTagFileFault, "reference tags: " + baselines_problem});
}

}  // namespace plumbline::vision
