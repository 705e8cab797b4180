// Diagnosis of an arm that uses measured arms of the same model as prior knowledge.
#pragma once

#include <functional>
#include <vector>

#include "app/measure/siblings/fleet_prior.h"

namespace plumbline::measure {

using Engine = std::function<Result<Diagnosis>(const model::CellModel&, MeasuredTable,
                                               const DiagnosisOptions&)>;

/// Diagnoses the arm twice: as declared, and with the prior updated by its rows. The prior is used
/// only if the arm's rows do not contradict it (Posterior::p_value, about 1 %), and if the held-out
/// error is clearly smaller with it, or is not clearly larger, the arm's own rows do not explain
/// it, and the prior's mean alone predicts them (most of the excess over their noise). The held-out
/// error is increased for the sizes that the held-out rows took part in fitting. What the arm's
/// rows show beyond the prior is written only if its causes are confirmed (RemoveUnconfirmed). The
/// prior's effects are then the first findings, each in doubt, and errors before correction are
/// those of the declared cell. The answer's `siblings` and its first note state what came from
/// where.
/// @param prior  an error: why there is none, which the answer states
/// @return       an error if the arm cannot be diagnosed
Result<Diagnosis> DiagnoseWithPrior(const model::CellModel& cell, const MeasuredTable& rows,
                                    const Result<FleetPrior>& prior, const Engine& engine,
                                    const DiagnosisOptions& options);

/// Diagnoses every sibling, and the arm with the prior that follows from them.
/// @param siblings  arms without findings
/// @return          an error if the arm cannot be diagnosed; a sibling that cannot is left out and
///                  named in the notes
Result<Diagnosis> DiagnoseWithSiblings(const model::CellModel& cell, const MeasuredTable& rows,
                                       std::vector<Arm> siblings, const Engine& engine,
                                       const DiagnosisOptions& options);

}  // namespace plumbline::measure
