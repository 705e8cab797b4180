// Held-out errors: cross-validation in which every fold repeats the selection and the fit of the
// effects.
#pragma once

#include <functional>
#include <optional>
#include <set>

#include "app/measure/diagnosis/result/diagnosis.h"
#include "app/measure/diagnosis/search/discrepancy.h"
#include "app/measure/diagnosis/validation/fold_plan.h"
#include "app/measure/diagnosis/validation/input_ranges.h"

namespace plumbline::measure {

/// Common input of all folds. The robust weights, sigma, the linearisation point, the maximum
/// number of effects, and whether empirical terms and a discrepancy model are allowed are those of
/// the fit of all rows. Each fold selects effects, joints, shapes and values itself.
struct HeldOutInput {
  const FitProblem& problem;
  std::shared_ptr<const Linearisation> linear;
  const Model& model;  ///< linearisation point of `linear`
  const Candidates& candidates;
  const InputsOfRows& inputs;
  bool with_unknown = false;    ///< folds may use empirical terms
  std::size_t most_blocks = 3;  ///< maximum of each fold's search
  bool with_discrepancy = false;
  const DiagnosisOptions& options;
  /// Called by the calling thread with the share of a cross-validation that is done; may be empty.
  std::function<void(double share)> progress = {};
};

/// An effect selected by the search of a fold, with its joints.
struct SelectedEffect {
  EffectKey key;
  std::set<int> joints;
};

/// The effects of an explanation with their joints.
std::vector<SelectedEffect> SelectedEffects(const CandidateSet& candidate_set,
                                            const Explanation& explanation);

/// Residuals of each row from models chosen and fitted without its fold.
struct HeldOut {
  std::string by;
  PerRow<int> fold_of;
  /// False if the other folds have too few rows (in total, or of the row's session), or if they do
  /// not determine whether an event occurred before or after the row.
  PerRow<bool> predicted;
  PerRow<double> distance;  ///< of a predicted row from the stored poses of the other folds [rad]
  PerRow<double> reach;     ///< largest distance of a row of the other folds from those poses [rad]
  PerRow<BeyondRanges> beyond;  ///< of its other inputs from the rows of the other folds
  bool other_sessions = false;  ///< folds are sessions
  PerRow<Vec3> before;          ///< [m], declared model with the frames of the other folds
  PerRow<Vec3> after;           ///< [m], with the fold's named effects and discrepancy model
  PerRow<Vec3> after_named;     ///< [m], with the fold's named effects only
  std::vector<std::vector<SelectedEffect>> selected;  ///< by each searched fold
};

/// Repeats the search for every fold and, if requested, fits a discrepancy model of the fold from
/// scratch. Folds run in parallel; the result does not depend on the number of threads.
HeldOut HoldOut(const HeldOutInput& input, const FoldPlan& plan);

/// 3-D RMS over the predicted rows that are not outliers (kOutlierWeight), with a bootstrap
/// interval over clusters; nullopt if there are no such rows.
std::optional<HeldOutError> ErrorOf(const FitProblem& problem, const HeldOut& held_out,
                                    int resamples);

/// The share of a correction y -> s y that predicts the held-out rows of a scheme best, with their
/// errors b before and a after it:
///   s = sum b . (b - a) / sum |b - a|^2,   0..1; 1 if it moves none
/// [least squares; the shrinkage of Copas, J. R. Stat. Soc. B 45 (1983) 311]. Outliers do not
/// count.
double BestShare(const HeldOut& scheme, const PerRow<double>& weights);

// Validation of a model by held-out rows: its errors, and which of its parts are accepted.

/// Held-out predictions for every fold plan that the rows permit.
struct Validation {
  std::vector<HeldOut> schemes;      ///< blocks of time first
  std::vector<HeldOutError> errors;  ///< of the schemes with predicted rows
  /// Prediction from one half of the joint space to the other, if requested. Not one of `schemes`,
  /// since it decides on no part of the model: it only determines how the correction fades with the
  /// distance.
  std::optional<HeldOut> halves{};
  double added_error_m =
      0;  ///< from AddError: included in `errors`, not in the residuals of the rows
};

/// Holds rows out by blocks of time, regions of the joint space and sessions, and if `with_halves`,
/// by halves of the joint space.
Validation Validate(const HeldOutInput& input, bool with_halves = false);

/// True if the discrepancy model reduces the error of held-out regions and of held-out sessions; if
/// neither could be held out, that of blocks of time.
bool AdmitsDiscrepancy(const Validation& validation, const PerRow<double>& weights);

/// Recomputes the errors without the discrepancy model.
Validation WithoutDiscrepancy(const HeldOutInput& input, Validation validation);

/// Adds, in squares, an error that the written model has in addition to the held-out ones.
void AddError(double added_error_m, Validation& validation);

/// Reason why the correction must not be written: it predicts held-out rows worse than the declared
/// model, or no row could be held out. Empty if it may be written. With an empirical term, no
/// scheme may be worse; otherwise, only the prediction between the rows (blocks of time) is
/// decisive.
std::string ReasonToWithhold(const Validation& validation, bool empirical);

}  // namespace plumbline::measure
