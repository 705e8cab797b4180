// Recorded signals that the residual follows: permutation tests, and its spectrum along the joints.
#pragma once

#include <vector>

#include "app/measure/diagnosis/result/diagnosis.h"
#include "app/measure/diagnosis/search/identify.h"

namespace plumbline::measure {

/// All recorded signals, each with the p-value that the residual of the identified model follows it
/// (by sign flips of clusters), and the spectrum of the residual along each joint angle.
struct ResidualSignals {
  std::vector<SignalTrace> traces;
  std::vector<SpectralLine> spectrum;
};

/// @param all  every row; supplies the reported values. The p-values are of the searched rows only.
ResidualSignals SignalsOfResidual(const Dataset& all, const Identified& found);

}  // namespace plumbline::measure
