// Moments of which nothing says whether an event has happened.
#pragma once

#include <optional>

#include "firmware-like/effects/written.h"

namespace plumbline {

/// When an event happened that is known only to lie between two rows.
struct AmbiguousEventTime {
  bool is_row = false;  ///< counted in rows, else in seconds
  Interval between;
};

/// The interval about an event's moment that its deviation leaves open, if these conditions lie in
/// it: even between two rows, sqrt(3) deviations to either side.
std::optional<AmbiguousEventTime> MomentLeftOpen(const ActiveEffect& effect, const Conditions& conditions);

}  // namespace plumbline
