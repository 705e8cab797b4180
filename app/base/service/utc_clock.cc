#include "app/base/service/utc_clock.h"

#include <chrono>
#include <cmath>

#include "drivers/clock.h"

namespace plumbline::service {

UtcClock UtcClock::FromSystemClock() {
  return {SystemUtcSeconds(), MonotonicSeconds()};
}

std::optional<double> UtcClock::DetectStep(double utc_s, double monotonic_s) {
  constexpr double kMinStep_s = 1;
  const double step_s = utc_s - UtcAt(monotonic_s) - reported_s_;
  if (std::abs(step_s) < kMinStep_s) return std::nullopt;
  reported_s_ += step_s;
  return step_s;
}

double SystemUtcSeconds() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace plumbline::service
