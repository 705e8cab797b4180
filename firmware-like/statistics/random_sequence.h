// Reproducible pseudo-random number generator for sampling inside pure functions.
#pragma once

#include <cstdint>

namespace plumbline::statistics {

/// SplitMix64 [Steele, Lea & Flood, OOPSLA 2014]. The same seed gives the same numbers on every
/// platform.
class RandomSequence {
 public:
  explicit RandomSequence(std::uint64_t seed) : state_(seed) {}

  std::uint64_t Next() {
    std::uint64_t z = (state_ += 0x9E3779B97F4A7C15U);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
    return z ^ (z >> 31);
  }
  /// Uniform in [0, 1).
  double Uniform() { return static_cast<double>(Next() >> 11) * 0x1.0p-53; }
  /// Uniform in 0..count-1; the bias for small counts is below 1e-15.
  std::uint64_t Below(std::uint64_t count) {
    return static_cast<std::uint64_t>(Uniform() * static_cast<double>(count));
  }

 private:
  std::uint64_t state_;
};

}  // namespace plumbline::statistics
