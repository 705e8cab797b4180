#include "firmware-like/scene/interference_watch.h"

#include <cmath>

namespace plumbline::scene {

std::optional<Proximity> InterferenceWatch::Update(std::optional<double> distance_m) {
  measured_ = distance_m && std::isfinite(*distance_m);
  if (!measured_) return std::nullopt;
  const double touching_to_m = state_ == Proximity::kInterference ? limits_.end_m : 0;
  const double near_to_m = limits_.near_m + (state_ == Proximity::kApart ? 0 : limits_.end_m);
  Proximity now = Proximity::kApart;
  if (*distance_m <= touching_to_m) {
    now = Proximity::kInterference;
  } else if (limits_.near_m > 0 && *distance_m <= near_to_m) {
    now = Proximity::kNear;
  }
  if (now == state_) return std::nullopt;
  state_ = now;
  return now;
}

}  // namespace plumbline::scene
