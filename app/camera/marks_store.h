// The fixed marks as they stood when each lens was last in order, kept over a restart.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "app/camera/fixed_marks.h"
#include "firmware-like/result.h"

namespace plumbline {

std::string MarksJson(const std::map<std::int64_t, MarksMemory>& memories, const Body& cell);
/// @return  nothing in it where the marks are declared otherwise than when it was written
Result<std::map<std::int64_t, MarksMemory>> MarksFromJson(const std::string& text,
                                                          const Body& cell);

/// One file, replaced as a whole at each change; by the id of the lens store, which no two cameras
/// share. Any thread.
class MarksStore {
 public:
  /// A file that cannot be read is as none: the marks are judged anew, and it is kept as
  /// `path`.unread when they are written. @param problem  says so
  MarksStore(std::string path, Body cell, std::string& problem);

  std::shared_ptr<const MarksMemory> Find(std::int64_t lens_id) const;
  /// @return  why it could not be kept
  Result<void> Keep(std::int64_t lens_id, const MarksMemory& memory);

 private:
  const std::string path_;
  const Body cell_;
  mutable std::mutex mutex_;
  bool unread_ = false;
  std::map<std::int64_t, MarksMemory> memories_;
};

}  // namespace plumbline
