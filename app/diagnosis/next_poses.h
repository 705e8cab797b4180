// Where to measure next: poses that separate explanations the data cannot tell apart.
#pragma once

#include "app/diagnosis/diagnosis.h"
#include "app/diagnosis/search.h"

namespace plumbline {

/// Greedy T-optimal design [Atkinson & Fedorov 1975, Biometrika 62(1)]: each next pose is the one
/// where the answer's displacement is farthest from what the refitted rival could still predict
/// there. Candidates are random poses within the joint limits (the rows' range where there are
/// none), reached by the arm above its base plane, with the payloads seen and none.
/// @param answer, rivals  explanations of the pool; the rivals' effects stand for `id`
std::vector<NextPose> NextPoses(const Pool& pool, const Model& model, const Explanation& answer,
                                const std::vector<Explanation>& rivals, int count, int threads);

}  // namespace plumbline
