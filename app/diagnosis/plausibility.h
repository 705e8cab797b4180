// Whether the values of an effect are ones that a sound machine shows.
#pragma once

#include <string>

#include "app/diagnosis/dataset.h"

namespace plumbline {

struct Implausible {
  std::string sentence;  ///< empty: every value is plausible
  double times = 0;      ///< the value over the bound that it passes; infinite for a wrong sign
};

/// The first value of an effect outside the plausible range of its parameter, or which makes the
/// whole compliance of a joint negative. Empirical effects have no such range.
Implausible ImplausibilityOf(const Dataset& data, const ActiveEffect& effect);

}  // namespace plumbline
