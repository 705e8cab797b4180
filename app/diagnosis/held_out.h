// Errors on rows that took part neither in choosing nor in fitting.
#pragma once

#include <optional>
#include <set>

#include "app/diagnosis/diagnosis.h"
#include "app/diagnosis/fold_plan.h"
#include "app/diagnosis/remainder.h"

namespace plumbline {

/// What every fold starts from. What all rows share are the robust weights, sigma and the point of
/// linearisation, which come from the fit of all rows; a fold takes nothing else from it.
struct HeldOutInput {
  const Dataset& data;
  std::shared_ptr<const Linearisation> linear;
  const Model& model;  ///< at which `linear` was taken
  const Candidates& candidates;
  const std::vector<double>& weights;
  double sigma_m = 0;
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
  std::vector<int> fold_of;  ///< of each row
  /// False where too few rows are beside the fold, of its session or at all, and next to a step
  /// whose moment the rows beside the fold leave open.
  std::vector<bool> predicted;
  std::vector<double>
      distance;                 ///< of a predicted row from the poses kept of the other folds [rad]
  bool other_sessions = false;  ///< no row of its session is among the other folds
  std::vector<Vec3> before;     ///< [m], frames of the other folds
  std::vector<Vec3> after;      ///< [m], by named effects and the fold's discrepancy model
  std::vector<Vec3> after_named;                      ///< [m], by named effects alone
  std::vector<std::vector<SelectedEffect>> selected;  ///< of each fold that was searched
};

/// Every fold searches anew; where `with_discrepancy`, it fits its discrepancy model from scratch.
/// Folds run in parallel; the result does not depend on the number of threads.
HeldOut HoldOut(const HeldOutInput& input, const FoldPlan& plan);

/// 3-D RMS over the rows that were predicted and are no outliers (kOutlierWeight), and a bootstrap
/// interval over clusters; nothing where there is none.
std::optional<HeldOutError> ErrorOf(const Dataset& data, const HeldOut& held_out,
                                    const std::vector<double>& weights, int resamples);

}  // namespace plumbline
