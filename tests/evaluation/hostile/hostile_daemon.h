// The real daemon between a robot that misbehaves and a PLC.
#pragma once

#include <string>

namespace hostile {

/// Runs plumblined with some of the kinds over each line, polls its registers as a PLC does, and
/// prints how many valid answers held the payload of another robot, or an older one than
/// stale_after_ms allows. The payload is the time at which it was sampled.
/// @return the number of wrong answers; -1 if a robot that answers correctly is never valid
long EvaluateDaemon(const std::string& plumblined, double seconds);

}  // namespace hostile
