// Uncertainty of an event time: the span in which it is unknown whether the event has happened.
#pragma once

#include <optional>

#include "firmware-like/effects/written.h"

namespace plumbline::effects {

/// Span of an event that is only known to have occurred between two rows.
struct EventTimeUncertainty {
  bool is_row = false;  ///< in row numbers, otherwise in seconds
  model::Interval between;
};

/// The span of uncertainty around an event time, if the conditions lie within it; otherwise
/// nullopt. The time is uniformly distributed between two rows, so the span extends sqrt(3)
/// standard deviations to either side.
std::optional<EventTimeUncertainty> UncertaintyOfEventTime(const ActiveEffect& effect,
                                                           const Conditions& conditions);

}  // namespace plumbline::effects
