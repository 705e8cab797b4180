// Identification of a model from rows: search, refit and robust weighting, iterated until they
// agree.
#pragma once

#include "app/measure/diagnosis/linear/refit.h"
#include "app/measure/diagnosis/result/diagnosis.h"
#include "app/measure/diagnosis/search/search.h"

namespace plumbline::measure {

/// The identified model, with the candidates and alternatives of the selection.
struct Identified {
  explicit Identified(FitProblem every_row) : fit(std::move(every_row)) {}

  FitProblem fit;  ///< sigma: as declared, or larger if the rows scatter more
  Candidates candidates;
  Model aligned;  ///< frames estimated without effects
  /// Residuals of the model below; gradients of the arm without effects at `linear_frames` and
  /// `linear_places`.
  std::shared_ptr<const Linearisation> linear;
  Indexed<SessionIndex, Model::Frames> linear_frames;
  Indexed<ArtefactIndex, PlacedArtefact> linear_places;
  Model model;
  Refit refit;
  std::unique_ptr<LinearProblem> problem;
  std::unique_ptr<CandidateSet> candidate_set;
  std::vector<Explanation> ranked;  ///< with catalogue effects only, best first
  Explanation best;
  bool unknown = false;  ///< `best` contains an empirical term
  /// An event was dropped because its rows are outliers (event_outliers.h); more than kMaxOutliers
  /// of the rows may then be rejected.
  bool many_outliers = false;
};

/// Identifies the effects that explain the rows.
/// @param progress  completed share 0..1 and current activity
/// @param most      maximum number of blocks in an explanation
Result<Identified> Identify(const Dataset& data, const Model& aligned,
                            const DiagnosisOptions& options,
                            const std::function<void(double, const std::string&)>& progress,
                            std::size_t most = kMaxBlocks);

/// Number of parameters fitted to the rows: of the named effects, free frames and positions of
/// artefacts, minus what is known about the positions.
double ParametersOf(const Identified& found, const Dataset& data);

/// Residuals of the model with the gradients of the arm without added effects. The columns of an
/// effect are thus independent of the other effects, and the working response y = residual + (d
/// prediction / d influence) influence contains the nonlinear part of the model.
/// @param before  an earlier linearisation at the same frames, whose gradients are reused; or null
Result<Linearisation> LineariseApart(const Dataset& data, const Model& model, int threads,
                                     const Linearisation* before = nullptr);

}  // namespace plumbline::measure
