// UTC clock without steps, for time-dependent effects and the journal.
#pragma once

#include <optional>

namespace plumbline::service {

/// UTC in seconds since 1970, read once at start-up and advanced by the monotonic clock, which
/// follows the small corrections of a time service but no steps. Time-dependent effects therefore
/// never jump; a step of the system clock is only detected, and takes effect at the next start.
class UtcClock {
 public:
  /// @param utc_s, monotonic_s  readings of both clocks at the same moment
  UtcClock(double utc_s, double monotonic_s) : offset_s_(utc_s - monotonic_s) {}
  /// Initialised from the clocks of this computer, now.
  static UtcClock FromSystemClock();

  double UtcAt(double monotonic_s) const { return monotonic_s + offset_s_; }

  /// Detects a step of the system clock since the start or since the last detected step.
  /// @return  the step [s], or nullopt if it is less than a second
  std::optional<double> DetectStep(double utc_s, double monotonic_s);

 private:
  double offset_s_;
  double reported_s_ = 0;  ///< sum of the steps returned so far
};

/// UTC of the system clock, including its steps [s since 1970].
double SystemUtcSeconds();

}  // namespace plumbline::service
