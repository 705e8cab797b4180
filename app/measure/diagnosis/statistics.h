// Tail of the F distribution and a reproducible random number generator.
#pragma once

#include <cstdint>
#include <vector>

namespace plumbline::measure {

/// Upper tail probability P(F_{d1,d2} > value).
double FisherTail(double value, double d1, double d2);

/// Random number generator with the same sequence on every platform [Steele et al. 2014,
/// splitmix64].
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t Next();
  double Uniform();      ///< in [0, 1)
  int Below(int count);  ///< in 0..count-1
  /// -1 or 1.
  double Sign() { return Next() >> 63 ? 1.0 : -1.0; }

 private:
  std::uint64_t state_;
};

}  // namespace plumbline::measure
