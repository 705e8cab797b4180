#include "app/camera/reference_tags.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "app/camera/tag_fit.h"
#include "firmware-like/statistics/chi_square.h"

namespace plumbline::camera {
namespace {

constexpr std::size_t kMinTagsForPose = 2, kMinTagsToExclude = 3;

bool IsAccepted(const std::optional<TagFit>& fit) {
  return fit && statistics::ChiSquareTail(fit->chi2, std::max(1, fit->degrees_of_freedom)) >=
                    kSignificance;
}

void Accept(const TagFit& fit, TagTestOutcome verdict, TagTestResult& judgement) {
  judgement.verdict = verdict;
  judgement.chi2 = fit.chi2;
  judgement.degrees_of_freedom = fit.degrees_of_freedom;
  judgement.X_CK = fit.X_CK;
}

/// Tests whether a rigid motion of the camera, with the lens unchanged, explains the corners.
bool CameraMoved(const lens::KnownLens& lens, const TagFitProblem& problem,
                 TagTestResult& judgement) {
  if (problem.observations.size() < kMinTagsForPose) return false;
  const auto moved = FitTags(lens.lens, problem, {.pose = true});
  if (!IsAccepted(moved)) return false;
  const auto both = FitTags(lens.lens, problem, {.pose = true, .focal = true});
  if (both && moved->chi2 - both->chi2 > kFocalChi2Gain) return false;
  Accept(*moved, TagTestOutcome::kCameraMoved, judgement);
  // Pose of the new camera in the old one.
  const Pose X = problem.start * moved->X_CK.Inverse();
  judgement.moved_m = X.p.norm();
  judgement.turned_rad = tracking::AngleBetween(problem.start, moved->X_CK);
  return true;
}

/// Tests whether excluding one tag makes the others agree.
bool OneTagMoved(const lens::KnownLens& lens, const TagFitProblem& problem,
                 const FreeParameters& free, TagTestResult& judgement) {
  if (problem.observations.size() < kMinTagsToExclude) return false;
  std::optional<TagFit> best;
  int moved_id = 0;
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    const auto fit = FitTags(lens.lens, problem.Without(i), free);
    if (fit && (!best || fit->chi2 < best->chi2)) best = fit, moved_id = problem.observations[i].id;
  }
  if (!IsAccepted(best)) return false;
  Accept(*best, TagTestOutcome::kGood, judgement);
  judgement.excluded = {moved_id};
  return true;
}

TagTestResult JudgeAgainstBaseline(const lens::KnownLens& lens, const TagFitProblem& problem) {
  TagTestResult judgement;
  const auto still = FitTags(lens.lens, problem, {});
  if (!still) return judgement;
  judgement.rms_px = still->rms_px;
  Accept(*still, TagTestOutcome::kGood, judgement);
  if (IsAccepted(still)) return judgement;
  const auto zoomed = FitTags(lens.lens, problem, {.focal = true});
  if (IsAccepted(zoomed)) {
    Accept(*zoomed, TagTestOutcome::kZoomDrifted, judgement);
    judgement.log_focal = zoomed->log_focal;
    judgement.log_focal_sd = zoomed->log_focal_sd;
    return judgement;
  }
  if (CameraMoved(lens, problem, judgement) || OneTagMoved(lens, problem, {}, judgement))
    return judgement;
  judgement.verdict = TagTestOutcome::kBad;
  return judgement;
}

TagTestResult JudgeWithoutBaseline(const lens::KnownLens& lens, const TagFitProblem& problem) {
  TagTestResult judgement;
  if (problem.observations.size() < kMinTagsForPose) return judgement;
  const auto fit = FitTags(lens.lens, problem, {.pose = true});
  if (!fit) {
    judgement.verdict = TagTestOutcome::kBad;
    return judgement;
  }
  judgement.rms_px = fit->rms_px;
  Accept(*fit, TagTestOutcome::kGood, judgement);
  if (IsAccepted(fit) || OneTagMoved(lens, problem, {.pose = true}, judgement)) return judgement;
  judgement.verdict = TagTestOutcome::kBad;
  return judgement;
}

}  // namespace

TagTestResult TestReferenceTags(const lens::KnownLens& lens, const tracking::Body& cell,
                                const std::vector<tracking::SeenTag>& seen,
                                const TagBaseline* baseline, const TagCheckSettings& settings) {
  if (baseline != nullptr) {
    const TagFitProblem problem = ProblemAgainstBaseline(cell, seen, *baseline, settings);
    return problem.observations.empty() ? TagTestResult{} : JudgeAgainstBaseline(lens, problem);
  }
  const auto problem = ProblemWithoutBaseline(lens, lens.covariance, cell, seen, settings);
  return problem ? JudgeWithoutBaseline(lens, *problem) : TagTestResult{};
}

TagBaseline BaselineAt(const lens::KnownLens& lens, const tracking::Body& cell,
                       const std::vector<tracking::SeenTag>& seen, const Pose& X_CK) {
  TagBaseline baseline{X_CK, {}};
  for (const TagObservation& observation : ObservedReferenceTags(cell, seen)) {
    TagBaseline::Tag& tag = baseline.tags[observation.id];
    for (std::size_t k = 0; k < 4; ++k) {
      tag.residual_px[k] =
          observation.pixels[k] - Project<double>(lens.lens, X_CK * observation.p_K[k]);
    }
    tag.covariance = observation.covariance;
  }
  return baseline;
}

std::optional<lens::KnownLens> RefineFocalLength(const lens::KnownLens& lens, double prior_sd,
                                                 const tracking::Body& cell,
                                                 const std::vector<tracking::SeenTag>& seen,
                                                 const TagCheckSettings& settings) {
  const auto problem =
      ProblemWithoutBaseline(lens, lens::LensCovariance::Zero(), cell, seen, settings);
  if (!problem || problem->observations.size() < kMinTagsForPose || !(prior_sd > 0))
    return std::nullopt;
  const auto fit = FitTags(lens.lens, *problem, {.pose = true, .focal = true});
  if (!fit) return std::nullopt;
  const double tag_variance = fit->log_focal_sd * fit->log_focal_sd, prior = prior_sd * prior_sd;
  const double shift = fit->log_focal * prior / (prior + tag_variance);
  const double shrink = std::sqrt(tag_variance / (prior + tag_variance));
  lens::KnownLens refined = lens;
  refined.lens.fx *= std::exp(shift);
  refined.lens.fy *= std::exp(shift);
  refined.covariance.topRows<2>() *= shrink;
  refined.covariance.leftCols<2>() *= shrink;
  return refined;
}

lens::KnownLens WithFocalDrift(const lens::KnownLens& lens, double log_focal, double log_focal_sd) {
  lens::KnownLens drifted = lens;
  drifted.lens.fx *= std::exp(log_focal);
  drifted.lens.fy *= std::exp(log_focal);
  const lens::Vec2 by_focal(drifted.lens.fx, drifted.lens.fy);
  drifted.covariance.topLeftCorner<2, 2>() +=
      log_focal_sd * log_focal_sd * by_focal * by_focal.transpose();
  return drifted;
}

}  // namespace plumbline::camera
