// Persistent store of reference-tag baselines, one per lens.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>

#include "app/vision/camera/reference_tags.h"
#include "firmware-like/result.h"

namespace plumbline::vision {

/// Observations of the reference tags through each lens, by the id of the lens.
struct TagBaselines {
  std::map<std::int64_t, TagBaseline> by_lens;
  /// Lenses that the tags have contradicted since they were accepted.
  std::set<std::int64_t> contradicted;
};

std::string TagBaselinesJson(const TagBaselines& baselines, const target::Body& cell);
/// @return  empty if the declared tags have changed since the text was written
Result<TagBaselines> TagBaselinesFromJson(const std::string& text, const target::Body& cell);

/// One JSON file, replaced as a whole at each change. The key is the id in the lens store, which is
/// unique across cameras. Thread-safe.
class TagBaselineStore {
 public:
  /// If the file cannot be read, the store starts empty and the next Store() preserves the file as
  /// `path`.unread.
  /// @param problem  set to the reason if the file cannot be read
  TagBaselineStore(std::string path, target::Body cell, std::string& problem);

  /// @return  null if there is no baseline for that lens
  std::shared_ptr<const TagBaseline> Find(std::int64_t lens_id) const;
  /// @return  an error if the file cannot be written; the baseline is then only in memory
  Result<void> Store(std::int64_t lens_id, const TagBaseline& baseline);
  /// Until a baseline of this lens is stored.
  Result<void> StoreContradiction(std::int64_t lens_id);
  bool IsContradicted(std::int64_t lens_id) const;

 private:
  Result<void> Write();

  const std::string path_;
  const target::Body cell_;
  mutable std::mutex mutex_;
  bool unreadable_ = false;  ///< the existing file could not be read and has not been renamed yet
  TagBaselines baselines_;
};

}  // namespace plumbline::vision
