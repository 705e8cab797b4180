#include "app/plant/broker/memory_limit.h"

#include <cstdlib>
#include <fstream>
#include <string>

namespace plumbline::plant {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

/// Private writable memory, which RLIMIT_DATA counts; 0 if unknown.
rlim_t DataNow_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmData:")) return 1024 * std::strtoull(line.c_str() + 7, nullptr, 10);
  }
  return 0;
}

}  // namespace

MemoryGrowthLimit::MemoryGrowthLimit(std::size_t bytes) {
  getrlimit(RLIMIT_DATA, &before_);
  const rlim_t now = DataNow_bytes();
  if (kSanitized || now == 0) return;
  rlimit limit = before_;
  if (now + bytes < limit.rlim_cur) limit.rlim_cur = now + bytes;
  setrlimit(RLIMIT_DATA, &limit);
}

MemoryGrowthLimit::~MemoryGrowthLimit() {
  setrlimit(RLIMIT_DATA, &before_);
}

}  // namespace plumbline::plant
