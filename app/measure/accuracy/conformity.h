// Decision whether a measured error is within its tolerance, taking its uncertainty into account.
#pragma once

namespace plumbline::measure {

enum class Decision { kConforms, kDoesNotConform, kNotDecided };

/// Decision rule of ISO 14253-1: the uncertainty counts against the party that makes the
/// statement. An error conforms only if |error| + U <= tolerance, and does not conform only if
/// |error| - U > tolerance.
/// @param error_m, expanded_m, tolerance_m  [m]; the error's sign is irrelevant
/// @return  not decided also if a value is not finite
Decision Decide(double error_m, double expanded_m, double tolerance_m);

}  // namespace plumbline::measure
