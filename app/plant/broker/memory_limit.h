// Limit on the memory that this process may add.
#pragma once

#include <sys/resource.h>

#include <cstddef>

namespace plumbline::plant {

/// While an object of this class exists, allocations fail once the process has grown by that much
/// (RLIMIT_DATA). libmosquitto allocates the length that a broker announces, up to 256 MB, before
/// it has received a byte of it, and has no limit of its own; with this one it gives up the
/// connection instead. Has no effect under the sanitizers, which need more.
class MemoryGrowthLimit {
 public:
  explicit MemoryGrowthLimit(std::size_t bytes);
  ~MemoryGrowthLimit();
  MemoryGrowthLimit(const MemoryGrowthLimit&) = delete;
  MemoryGrowthLimit& operator=(const MemoryGrowthLimit&) = delete;

 private:
  rlimit before_{};
};

/// What a publisher needs in addition to its start, several times over.
inline constexpr std::size_t kMaxGrowth_bytes = 48'000'000;

}  // namespace plumbline::plant
