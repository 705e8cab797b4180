// Uncertainty of an event time: the span in which the event may or may not have happened.
#pragma once

#include <optional>

#include "firmware-like/effects/written.h"

namespace plumbline::effects {

/// Span of an event that is only known to lie between two rows.
struct EventTimeUncertainty {
  bool is_row = false;  ///< in row numbers, otherwise in seconds
  model::Interval between;
};

/// The span around an event time that its standard deviation leaves open, if the conditions lie
/// within it; otherwise nullopt. The time is uniformly distributed between two rows, so the span
/// reaches sqrt(3) standard deviations to either side.
std::optional<EventTimeUncertainty> UncertaintyOfEventTime(const ActiveEffect& effect,
                                                           const Conditions& conditions);

}  // namespace plumbline::effects
