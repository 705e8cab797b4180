// Diagnosis of an arm with what measured arms of the same model have in common as prior knowledge.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "app/config/fault.h"
#include "app/siblings/arm_fit.h"

namespace plumbline::siblings {

using Engine = std::function<Result<diagnosis::Diagnosis>(
    const model::CellModel&, table::MeasuredTable, const diagnosis::DiagnosisOptions&)>;

/// The two files of a sibling's folder.
std::string CellFileOf(const std::string& folder);
std::string RowsFileOf(const std::string& folder);
/// Reads both.
/// @param faults  receives warnings
/// @return        an error with the folder and the remedy
Result<Arm> ReadArm(const std::string& folder, config::FaultList& faults);

/// Why the second cell is not declared like the first: another number of joints, nominal kinematics
/// (a, d beyond 1 mm, angles beyond 0.1 degrees), declared compliances or link masses (1 %), or
/// effects of its own. Empty: it is.
std::string DifferenceOf(const model::CellModel& a, const model::CellModel& b);

/// What the siblings know of one size, and what the rows of the arm made of it.
struct SizePrior {
  SizeKey key;
  Pooled pooled;
};

/// Sizes that at least two, and at least half, of the arms show, fitted jointly in every arm, so
/// that arms in which a size was not selected take part, too. A mean near zero is knowledge as
/// well: it says which sizes differ from arm to arm, and by how much.
/// @param notes  receives a sentence for each arm in which they cannot be fitted
std::vector<SizePrior> PriorFrom(const std::vector<Arm>& arms, int threads,
                                 std::vector<std::string>& notes);

/// The prior updated by the rows of an arm: precision-weighted mean of the pooled sizes and a least
/// squares fit of all of them. Sizes that the rows do not determine keep their prior.
struct Posterior {
  /// With covariance; that between sizes of different effects is lost.
  std::vector<effects::ActiveEffect> effects;
  double parameters = 0;  ///< effective number of fitted ones
  /// Probability that an arm of this model differs from its siblings by as much as the rows show:
  /// tail of chi-square of the fitted sizes about their prior, under both covariances.
  double p_value = 1;
};
Result<Posterior> UpdatedBy(const Arm& arm, const std::vector<SizePrior>& prior, int threads);

/// Diagnoses every sibling, then the arm twice: as declared, and with the updated prior. The prior
/// is used only if the arm's rows do not contradict it (Posterior::p_value, 1 %) and the held-out
/// error is smaller with it; that error is increased for the sizes that the held-out rows took part
/// in fitting. Its effects are then the first findings, and
/// errors before are those of the declared cell. The answer's `siblings` states what came from
/// where.
/// @param siblings  arms without a diagnosis
/// @return          an error if the arm cannot be diagnosed; a sibling that cannot is left out and
///                  named in the notes
Result<diagnosis::Diagnosis> DiagnoseWithSiblings(const model::CellModel& cell,
                                                  const table::MeasuredTable& rows,
                                                  std::vector<Arm> siblings, const Engine& engine,
                                                  const diagnosis::DiagnosisOptions& options);

}  // namespace plumbline::siblings
