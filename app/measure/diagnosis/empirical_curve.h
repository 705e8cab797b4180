// An empirical term in words: what it changes, and by how much over the measured range.
#pragma once

#include <string>
#include <vector>

#include "firmware-like/effects/written.h"

namespace plumbline::measure {

/// The curve of one parameter of an empirical term.
struct EmpiricalCurve {
  std::string meaning;  ///< "the tool's bending", "axis 3", "length a of link 2", "the tip in z"
  std::string range;    ///< smallest and largest value of the curve: "0 to 19.6"
  std::string unit;     ///< "%", "mrad", "mm"
};

/// One curve for each parameter; none if the effect is not an empirical term.
std::vector<EmpiricalCurve> EmpiricalCurvesOf(const effects::ActiveEffect& effect);

}  // namespace plumbline::measure
