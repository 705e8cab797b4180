// Other explanations that the rows cannot rule out.
#pragma once

#include "app/diagnosis/findings.h"

namespace plumbline {

/// Adds the explanations without a finding that fit as well once refitted.
/// @return  those that were added, with the scores of their refits
std::vector<Explanation> AddRivals(const FindingsContext& context, const Model& model,
                                   Diagnosis& diagnosis);

}  // namespace plumbline
