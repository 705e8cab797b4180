// The time of effects and of the journal: UTC that runs evenly within a run of the daemon.
#pragma once

#include <optional>

namespace plumbline {

/// UTC in seconds since 1970, read once at the start and carried on by the monotonic clock (which
/// follows the small corrections of a time service, but no step). So effects of time never jump in
/// the cycle; a step of the computer's clock is told, and taken up at the next start.
class UtcClock {
 public:
  /// @param utc_s, monotonic_s  both clocks at one moment, the start
  UtcClock(double utc_s, double monotonic_s) : offset_s_(utc_s - monotonic_s) {}
  /// Of this computer, now.
  static UtcClock OfThisComputer();

  double UtcAt(double monotonic_s) const { return monotonic_s + offset_s_; }

  /// How far the computer's clock was set since the start, or since the last step that was told
  /// [s]; nothing below a second.
  std::optional<double> NewStep(double utc_s, double monotonic_s);

 private:
  double offset_s_;
  double told_s_ = 0;  ///< steps told so far
};

/// The computer's UTC, steps and all [s since 1970].
double ComputerUtcSeconds();

}  // namespace plumbline
