// Time span in which it is uncertain whether an event has already happened.
#pragma once

#include <optional>

#include "firmware-like/effects/written.h"

namespace plumbline::effects {

/// Span of an event that is only known to lie between two rows.
struct AmbiguousEventTime {
  bool is_row = false;  ///< in row numbers, otherwise in seconds
  model::Interval between;
};

/// The span around an event time that its standard deviation leaves open, if the conditions lie
/// within it; otherwise nullopt. Uniform between two rows: sqrt(3) standard deviations to either
/// side.
std::optional<AmbiguousEventTime> AmbiguousTimeOfEvent(const ActiveEffect& effect,
                                                       const Conditions& conditions);

}  // namespace plumbline::effects
