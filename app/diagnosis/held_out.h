// The error on rows that took part neither in choosing nor in fitting.
#pragma once

#include <optional>

#include "app/diagnosis/diagnosis.h"
#include "app/diagnosis/remainder.h"

namespace plumbline {

/// Residuals of each row from models chosen and fitted without its fold. What all rows share: the
/// robust weights, sigma and the point of linearisation, that come from the fit of all rows.
struct HeldOut {
  std::vector<int> fold_of;     ///< of each row
  std::vector<bool> predicted;  ///< false: too few rows beside its fold, of its session or at all
  std::vector<Vec3> before;     ///< [m], frames of the other folds
  std::vector<Vec3> after;      ///< [m]
};

/// Blocks of rows that follow each other, dealt to the folds in turn; repeats of a pose stay in
/// the fold of the first; `most_blocks` bounds each search. Each fold's search sees nothing of its
/// rows but through what HeldOut names. Where the whole set has a `remainder` (else null), every
/// fold tries its own.
HeldOut HoldOut(const Dataset& data, const std::shared_ptr<const Linearisation>& at,
                const Model& model, const Candidates& candidates,
                const std::vector<double>& weights, double sigma_m, bool with_unknown,
                std::size_t most_blocks, const Remainder* remainder,
                const DiagnosisOptions& options);

/// 3-D RMS over the rows that were predicted and are no outliers (kOutlierWeight), and a bootstrap
/// interval over clusters; nothing where there is none.
std::optional<HeldOutError> ErrorOf(const Dataset& data, const HeldOut& held_out,
                                    const std::vector<double>& weights, int resamples);

}  // namespace plumbline
