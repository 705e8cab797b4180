// Plausibility of the values of effects: whether a healthy machine can show them.
#pragma once

#include <string>

#include "app/measure/diagnosis/data/dataset.h"

namespace plumbline::measure {

struct Implausible {
  std::string sentence;  ///< empty if every value is plausible
  double times = 0;      ///< value divided by the exceeded bound; infinite for a wrong sign
};

/// Reports the first value of an effect that lies outside the plausible range of its parameter, or
/// that makes the total compliance of a joint negative. Empirical effects are never implausible.
Implausible ImplausibilityOf(const Dataset& data, const effects::ActiveEffect& effect);

}  // namespace plumbline::measure
