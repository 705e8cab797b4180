// Proposal of further measurements that separate rival explanations.
#pragma once

#include "app/measure/diagnosis/diagnosis.h"
#include "app/measure/diagnosis/search.h"

namespace plumbline::measure {

/// Proposes poses in the order of execution, the most informative first (`SequentialDesign`). Uses
/// the measured payloads if these separate all explanations; otherwise some poses are proposed
/// without payload, and a note says so. Another note names rivals that no pose separates.
/// @param answer, rivals  explanations, as columns of `candidate_set`; the scores of the rivals are
///                        those of their nonlinear refits
/// @param diagnosis       receives rival_separations, next_poses, next_poses_separate_all and notes
void AddNextPoses(const CandidateSet& candidate_set, const Model& model,
                  const PerRow<double>& weights, const Explanation& answer,
                  const std::vector<Explanation>& rivals, const DiagnosisOptions& options,
                  Diagnosis& diagnosis);

}  // namespace plumbline::measure
