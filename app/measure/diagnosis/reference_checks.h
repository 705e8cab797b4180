// Check whether a finding rests on a single declared length of the artefacts.
#pragma once

#include "app/measure/diagnosis/diagnosis.h"
#include "app/measure/diagnosis/identify.h"

namespace plumbline::measure {

/// A [[distance]] or the declared position, direction and radius of an artefact are references:
/// rows on artefacts are compared with them. Repeats the evaluation of the named effects with each
/// reference in turn treated as unknown. If a finding is then no longer worth its cost, an error of
/// that one value would have the same consequence as the effect, and nothing in the data
/// contradicts it: the check `references` of the finding fails, the finding is doubtful, and the
/// correction is withheld unless it is `useful` nevertheless
/// (TestedReferences::CorrectionIsUseful).
/// @param found  the answer whose findings are in `diagnosis`
Result<void> CheckReferences(const Identified& found, int threads, bool useful,
                             Diagnosis& diagnosis);

}  // namespace plumbline::measure
