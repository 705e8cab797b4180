// Mistakes in the data that no effect should be blamed for.
#pragma once

#include <optional>

#include "app/diagnosis/linearisation.h"

namespace plumbline::diagnosis {

/// Farther than any effect moves the middle row.
inline constexpr double kGross_m = 0.025;
/// Of the residual, that the right hypothesis falls below.
inline constexpr double kNamed = 0.2;

/// Asks of every known mistake (mistakes.h) how far the measured points lie from the predicted
/// ones, frames aligned, were it taken back: r_m, the median over the rows, r without any.
///  - A column whose unit changes from one line on is asked about first (unit_changes.h).
///  - Where r > 25 mm, farther than effects move the middle row (a base turned by a degree, which
///    base_frame holds plausible, goes as far: it is asked about, not corrected), the data are
///    refused. The mistake of least r_m is named where r_m < r / 5; a fit of tip or base must beat
///    a hypothesis without free numbers by half. The fifth is a judgement, no quantile: what
///    decides is that the least is named, and that the figures are told with it.
///  - A smaller one is named where it brings a residual to the noise (RobustSigma < 1.5 sigma) that
///    was three times as large, without any free number.
/// @return  a sentence with the evidence that says what to do; nothing where the residual is of the
///          size that effects have and no mistake explains it whole
std::optional<std::string> GrossError(const Dataset& data, const Linearisation& aligned,
                                      int threads);

}  // namespace plumbline::diagnosis
