#include "firmware-like/effects/event_time_uncertainty.h"

#include <cmath>

namespace plumbline::effects {

std::optional<EventTimeUncertainty> UncertaintyOfEventTime(const ActiveEffect& effect,
                                                           const Conditions& conditions) {
  const auto& specs = effect.term.effect->traits().parameters;
  for (std::size_t k = 0; k < effect.values.size(); ++k) {
    const ParameterSpec& spec = specs[effect.term.parameters[k].spec];
    const auto at = static_cast<Eigen::Index>(k);
    if (!IsEventTime(spec) || effect.covariance.rows() <= at) continue;
    const bool is_row = spec.name == "row";
    const std::optional<double>& now = is_row ? conditions.row : conditions.t_s;
    const double half = std::sqrt(3 * effect.covariance(at, at));
    const model::Interval between{effect.values[k] - half, effect.values[k] + half};
    if (now && *now > between.low && *now < between.high)
      return EventTimeUncertainty{is_row, between};
  }
  return std::nullopt;
}

}  // namespace plumbline::effects
