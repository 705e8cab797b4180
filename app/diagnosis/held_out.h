// Errors on rows that took part neither in choosing nor in fitting the effects.
#pragma once

#include <optional>
#include <set>

#include "app/diagnosis/diagnosis.h"
#include "app/diagnosis/discrepancy.h"
#include "app/diagnosis/fold_plan.h"

namespace plumbline::diagnosis {

/// What every fold starts from. From the fit of all rows come the robust weights, sigma, the point
/// of linearisation, how many effects a fold may combine, and whether it may use empirical terms
/// and a discrepancy model; which effects, joints, shapes and values is each fold's own choice.
struct HeldOutInput {
  const FitProblem& problem;
  std::shared_ptr<const Linearisation> linear;
  const Model& model;  ///< at which `linear` was taken
  const Candidates& candidates;
  bool with_unknown = false;    ///< folds may use empirical terms
  std::size_t most_blocks = 3;  ///< of each fold's search
  bool with_discrepancy = false;
  const DiagnosisOptions& options;
};

/// An effect that a fold's search selected, in which joints.
struct SelectedEffect {
  EffectKey key;
  std::set<int> joints;
};

/// Residuals of each row from models chosen and fitted without its fold.
struct HeldOut {
  std::string by;
  PerRow<int> fold_of;
  /// False where too few rows are beside the fold, of its session or at all, and next to a step
  /// whose moment the rows beside the fold leave open.
  PerRow<bool> predicted;
  PerRow<double> distance;      ///< of a predicted row from the poses kept of the other folds [rad]
  PerRow<double> reach;         ///< within which of those poses all of the other folds lie [rad]
  bool other_sessions = false;  ///< no row of its session is among the other folds
  PerRow<Vec3> before;          ///< [m], frames of the other folds
  PerRow<Vec3> after;           ///< [m], by named effects and the fold's discrepancy model
  PerRow<Vec3> after_named;     ///< [m], by named effects alone
  std::vector<std::vector<SelectedEffect>> selected;  ///< of each fold that was searched
};

/// Every fold searches anew; where `with_discrepancy`, it fits its discrepancy model from scratch.
/// Folds run in parallel; the result does not depend on the number of threads.
HeldOut HoldOut(const HeldOutInput& input, const FoldPlan& plan);

/// 3-D RMS over the rows that were predicted and are no outliers (kOutlierWeight), and a bootstrap
/// interval over clusters; nothing where there is none.
std::optional<HeldOutError> ErrorOf(const FitProblem& problem, const HeldOut& held_out,
                                    int resamples);

}  // namespace plumbline::diagnosis
