// Opinions of critics about an answer, and the fold that makes one verdict of them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/measure/diagnosis/result/diagnosis.h"

namespace plumbline::measure {

/// What a critic says about an answer. A critic examines the answer and changes nothing; an empty
/// opinion is no objection.
struct Opinion {
  Verdict permits = Verdict::kNoEffect;  ///< the strongest verdict that it permits
  std::vector<ExplanationCheck> checks{};
  std::vector<Doubt> doubts{};  ///< each permits at most `ambiguous`
  std::vector<Rival> rivals{};
  std::vector<std::string> drivers{};
  std::vector<std::string> notes{};
  std::optional<Misfit> misfit{};
  std::string withheld{};        ///< why the correction must not be written; empty: no reason
  bool noise_too_small = false;  ///< the declared noise is contradicted
};

/// Adds opinions to an answer, and is the only function that sets its verdict:
///   verdict = min(verdict, permitted by each opinion),  no_effect > explained > ambiguous >
///   unknown
/// so that the weakest verdict wins, and the order of the critics is only that of the sentences. A
/// driver is listed once; the first reason to withhold the correction is kept.
void FoldOpinions(std::vector<Opinion> opinions, Diagnosis& diagnosis);

}  // namespace plumbline::measure
