// Displacement of the measured point by an effect.
#pragma once

#include <vector>

#include "app/measure/diagnosis/fit_problem.h"
#include "firmware-like/effects/written.h"

namespace plumbline::measure {

/// RMS over rows of the distance between the predictions of the declared cell with and without an
/// effect [m].
struct TipDisplacement {
  double all_m = 0;            ///< by all values of the effect together
  std::vector<double> each_m;  ///< by each value with all other sizes at zero; 0 for a shape
};

/// Over at most 500 evenly spaced rows of the problem that are not outliers; errors of an
/// instrument that reads ranges displace nothing.
TipDisplacement TipDisplacementOf(const FitProblem& problem, const effects::ActiveEffect& effect);

}  // namespace plumbline::measure
