#include "app/camera/fixed_marks.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "app/camera/marks_fit.h"
#include "firmware-like/statistics/chi_square.h"

namespace plumbline {
namespace {

constexpr std::size_t kLeastForPose = 2, kLeastToLeaveOut = 3;

bool Holds(const std::optional<MarksFit>& fit) {
  return fit && ChiSquareTail(fit->chi2, std::max(1, fit->freedom)) >= kChance;
}

void Take(const MarksFit& fit, MarksVerdict verdict, MarksJudged& judged) {
  judged.verdict = verdict;
  judged.chi2 = fit.chi2;
  judged.freedom = fit.freedom;
  judged.X_CK = fit.X_CK;
}

/// The rigid motion that leaves the marks as they are and the focal length too.
bool CameraMoved(const KnownLens& lens, const MarksProblem& problem, MarksJudged& judged) {
  if (problem.sights.size() < kLeastForPose) return false;
  const auto moved = FitMarks(lens.lens, problem, {.pose = true});
  if (!Holds(moved)) return false;
  const auto both = FitMarks(lens.lens, problem, {.pose = true, .focal = true});
  if (both && moved->chi2 - both->chi2 > kTellsFocal) return false;
  Take(*moved, MarksVerdict::kCameraMoved, judged);
  // In the new camera's frame: where the old one stands.
  const Pose X = problem.start * moved->X_CK.Inverse();
  judged.moved_m = X.p.norm();
  judged.turned_rad = AngleBetween(problem.start, moved->X_CK);
  return true;
}

/// The mark without which nothing has moved.
bool OneMarkMoved(const KnownLens& lens, const MarksProblem& problem, const FitFreedom& free,
                  MarksJudged& judged) {
  if (problem.sights.size() < kLeastToLeaveOut) return false;
  std::optional<MarksFit> best;
  int odd = 0;
  for (std::size_t i = 0; i < problem.sights.size(); ++i) {
    const auto fit = FitMarks(lens.lens, problem.Without(i), free);
    if (fit && (!best || fit->chi2 < best->chi2)) best = fit, odd = problem.sights[i].id;
  }
  if (!Holds(best)) return false;
  Take(*best, MarksVerdict::kGood, judged);
  judged.left_out = {odd};
  return true;
}

MarksJudged Compared(const KnownLens& lens, const MarksProblem& problem) {
  MarksJudged judged;
  const auto still = FitMarks(lens.lens, problem, {});
  if (!still) return judged;
  judged.rms_px = still->rms_px;
  Take(*still, MarksVerdict::kGood, judged);
  if (Holds(still)) return judged;
  const auto zoomed = FitMarks(lens.lens, problem, {.focal = true});
  if (Holds(zoomed)) {
    Take(*zoomed, MarksVerdict::kZoomDrifted, judged);
    judged.log_focal = zoomed->log_focal;
    judged.log_focal_sd = zoomed->log_focal_sd;
    return judged;
  }
  if (CameraMoved(lens, problem, judged) || OneMarkMoved(lens, problem, {}, judged)) return judged;
  judged.verdict = MarksVerdict::kBad;
  return judged;
}

MarksJudged Alone(const KnownLens& lens, const MarksProblem& problem) {
  MarksJudged judged;
  if (problem.sights.size() < kLeastForPose) return judged;
  const auto fit = FitMarks(lens.lens, problem, {.pose = true});
  if (!fit) {
    judged.verdict = MarksVerdict::kBad;
    return judged;
  }
  judged.rms_px = fit->rms_px;
  Take(*fit, MarksVerdict::kGood, judged);
  if (Holds(fit) || OneMarkMoved(lens, problem, {.pose = true}, judged)) return judged;
  judged.verdict = MarksVerdict::kBad;
  return judged;
}

}  // namespace

MarksJudged JudgeMarks(const KnownLens& lens, const Body& cell, const std::vector<SeenTag>& seen,
                       const MarksMemory* memory, const MarkSettings& settings) {
  if (memory != nullptr) {
    const MarksProblem problem = ComparedMarks(cell, seen, *memory, settings);
    return problem.sights.empty() ? MarksJudged{} : Compared(lens, problem);
  }
  const auto problem = MarksAlone(lens, lens.covariance, cell, seen, settings);
  return problem ? Alone(lens, *problem) : MarksJudged{};
}

MarksMemory Remember(const KnownLens& lens, const Body& cell, const std::vector<SeenTag>& seen,
                     const Pose& X_CK) {
  MarksMemory memory{X_CK, {}};
  for (const MarkSight& sight : SightsOfMarks(cell, seen)) {
    MarksMemory::Tag& tag = memory.tags[sight.id];
    for (std::size_t k = 0; k < 4; ++k) {
      tag.residual_px[k] = sight.pixels[k] - Project<double>(lens.lens, X_CK * sight.p_K[k]);
    }
    tag.covariance = sight.covariance;
  }
  return memory;
}

std::optional<KnownLens> RefineFocal(const KnownLens& lens, double prior_sd, const Body& cell,
                                     const std::vector<SeenTag>& seen,
                                     const MarkSettings& settings) {
  const auto problem = MarksAlone(lens, LensCovariance::Zero(), cell, seen, settings);
  if (!problem || problem->sights.size() < kLeastForPose || !(prior_sd > 0)) return std::nullopt;
  const auto fit = FitMarks(lens.lens, *problem, {.pose = true, .focal = true});
  if (!fit) return std::nullopt;
  const double of_marks = fit->log_focal_sd * fit->log_focal_sd, prior = prior_sd * prior_sd;
  const double shift = fit->log_focal * prior / (prior + of_marks);
  const double shrink = std::sqrt(of_marks / (prior + of_marks));
  KnownLens refined = lens;
  refined.lens.fx *= std::exp(shift);
  refined.lens.fy *= std::exp(shift);
  refined.covariance.topRows<2>() *= shrink;
  refined.covariance.leftCols<2>() *= shrink;
  return refined;
}

KnownLens Drifted(const KnownLens& lens, double log_focal, double log_focal_sd) {
  KnownLens drifted = lens;
  drifted.lens.fx *= std::exp(log_focal);
  drifted.lens.fy *= std::exp(log_focal);
  const Vec2 by_focal(drifted.lens.fx, drifted.lens.fy);
  drifted.covariance.topLeftCorner<2, 2>() +=
      log_focal_sd * log_focal_sd * by_focal * by_focal.transpose();
  return drifted;
}

}  // namespace plumbline
