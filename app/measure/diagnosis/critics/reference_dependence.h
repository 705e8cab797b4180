// Findings that rest on a single declared length of the artefacts.
#pragma once

#include <vector>

#include "app/measure/diagnosis/data/dataset.h"
#include "app/measure/diagnosis/result/opinion.h"
#include "app/measure/diagnosis/search/identify.h"
#include "app/measure/diagnosis/validation/held_out.h"

namespace plumbline::measure {

/// A reference, and the effects of the answer that are still worth their cost with it unknown.
struct KeptWithout {
  Reference reference;
  std::vector<SelectedEffect> effects;
};

/// A [[distance]] or the declared position, direction and radius of an artefact are references:
/// rows on artefacts are compared with them. Repeats the evaluation of the named effects with each
/// reference in turn treated as unknown.
/// @return  empty without effects or references
Result<std::vector<KeptWithout>> EvaluateWithoutReferences(const Identified& found, int threads);

/// If a finding is no longer worth its cost without a reference, an error of that one value would
/// have the same consequence as the effect, and nothing in the data contradicts it: the check
/// `references` of the finding fails, the finding is doubtful, and the correction is withheld
/// unless it is `useful` nevertheless (TestedReferences::CorrectionIsUseful).
Opinion OpinionOnReferences(const std::vector<KeptWithout>& kept, const model::CellModel& cell,
                            bool useful, const std::vector<Finding>& findings);

}  // namespace plumbline::measure
