// Where to measure next: poses that separate explanations the data cannot tell apart.
#pragma once

#include "app/diagnosis/diagnosis.h"
#include "app/diagnosis/search.h"

namespace plumbline {

/// Proposes poses, the most telling first: each next one is the candidate (`PoseCandidates`) that
/// brings all pairs of explanations nearest to being told (`Contests::Gain`), the poses before it
/// measured. Once all are told, further poses are second witnesses. At the payloads that were
/// measured where these can tell; else some without payload, and a note says so,
/// as it does of rivals that no pose can tell.
/// @param answer, rivals  explanations of the pool; the rivals' scores are those of refits
/// @param diagnosis       gets next_poses, next_poses_tell_all and notes
void AddNextPoses(const Pool& pool, const Model& model, const std::vector<double>& weights,
                  const Explanation& answer, const std::vector<Explanation>& rivals,
                  const DiagnosisOptions& options, Diagnosis& diagnosis);

}  // namespace plumbline
