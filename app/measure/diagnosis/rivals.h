// Rival explanations that the rows cannot rule out.
#pragma once

#include "app/measure/diagnosis/findings.h"

namespace plumbline::measure {

/// Refits the other ranked explanations that replace some finding, and adds those within kRivalGap
/// of the answer to `diagnosis.rivals`.
/// @return  the added explanations, with the scores of their nonlinear refits
std::vector<Explanation> AddRivals(const FindingsContext& context, const Model& model,
                                   Diagnosis& diagnosis);

}  // namespace plumbline::measure
