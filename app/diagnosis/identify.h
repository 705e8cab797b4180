// The model that a set of rows supports: search, refit and robust weights until they agree.
#pragma once

#include "app/diagnosis/diagnosis.h"
#include "app/diagnosis/refit.h"
#include "app/diagnosis/search.h"

namespace plumbline::diagnosis {

/// What the rows support, with all that the choice was made from.
struct Identified {
  explicit Identified(FitProblem every_row) : fit(std::move(every_row)) {}

  FitProblem fit;  ///< sigma: declared, or larger where the rows scatter more
  Candidates candidates;
  Model aligned;  ///< frames as found before any effect
  /// Residuals of the model below; gradients of the arm without effects at `linear_frames`.
  std::shared_ptr<const Linearisation> linear;
  Indexed<SessionIndex, Model::Frames> linear_frames;
  Model model;
  Refit refit;
  std::unique_ptr<LinearProblem> problem;
  std::unique_ptr<CandidateSet> candidate_set;
  std::vector<Explanation> ranked;  ///< by the catalogue alone, best first
  Explanation best;
  bool unknown = false;  ///< the best needs an empirical term
  /// An event gave way to the reading that its rows are outliers (event_outliers.h): more than
  /// kMaxOutliers of the rows may be rejected.
  bool many_outliers = false;
};

/// @param tell  progress: a share of 0..1 and what is being done
/// @param most  blocks of an explanation
Result<Identified> Identify(const Dataset& data, const Model& aligned,
                            const DiagnosisOptions& options,
                            const std::function<void(double, const std::string&)>& tell,
                            std::size_t most = kMaxBlocks);

/// Residuals of the model, and gradients of the arm without its added effects: columns stay those
/// of each effect by itself, whatever acts, and y = residual + (d prediction / d influence)
/// influence carries only how far the model is from linear.
/// @param before  an earlier one at the same frames, whose gradients are taken; or null
Result<Linearisation> LineariseApart(const Dataset& data, const Model& model, int threads,
                                     const Linearisation* before = nullptr);

}  // namespace plumbline::diagnosis
