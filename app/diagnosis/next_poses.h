// Where to measure next: poses that separate explanations the data cannot tell apart.
#pragma once

#include "app/diagnosis/diagnosis.h"
#include "app/diagnosis/search.h"

namespace plumbline {

/// Proposes measurements in the order of execution, the most useful first (`SequentialDesign`): at
/// the payloads that were measured where these separate all explanations; else some without
/// payload, and a note says so, as it does of rivals that no pose separates.
/// @param answer, rivals  explanations of the pool; the rivals' scores are those of refits
/// @param diagnosis       gets next_poses, next_poses_separate_all and notes
void AddNextPoses(const Pool& pool, const Model& model, const PerRow<double>& weights,
                  const Explanation& answer, const std::vector<Explanation>& rivals,
                  const DiagnosisOptions& options, Diagnosis& diagnosis);

}  // namespace plumbline
