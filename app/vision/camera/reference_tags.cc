#include "app/vision/camera/reference_tags.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <vector>

#include "app/vision/camera/tag_fit.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::vision {
namespace {

// Largest group of reference tags that agree with each other.

constexpr std::size_t kMinTagsForPose = 2;

/// A majority of the tags that agree with each other, with the camera's pose free.
struct Majority {
  std::vector<std::size_t> members;
  TagFit fit;
};

constexpr int kCoordinatesOfTag = 8;

/// Whether the chi^2 of a fit is not rejected at kSignificance.
bool IsAccepted(const std::optional<TagFit>& fit) {
  return fit && statistics::ChiSquareTail(fit->chi2, std::max(1, fit->degrees_of_freedom)) >=
                    kSignificance;
}

/// Whether `members` tags are enough to outvote the others: more than half of `all`, at least two.
bool IsMajority(std::size_t members, std::size_t all) {
  return members >= kMinTagsForPose && 2 * members > all;
}

/// The observations at `members`, which are in ascending order.
TagFitProblem Only(const TagFitProblem& problem, const std::vector<std::size_t>& members) {
  TagFitProblem some = problem;
  for (std::size_t i = problem.observations.size(); i-- > 0;) {
    if (!std::binary_search(members.begin(), members.end(), i)) some = some.Without(i);
  }
  return some;
}

/// Ids of the tags that are not among `members`.
std::vector<int> IdsExcept(const TagFitProblem& problem, const std::vector<std::size_t>& members) {
  std::vector<int> ids;
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    if (!std::binary_search(members.begin(), members.end(), i)) {
      ids.push_back(problem.observations[i].id);
    }
  }
  return ids;
}

/// Whether the tag at `index` agrees with the tags at `members`: the increase of chi^2 is that of
/// its coordinates' noise.
bool Joins(const lens::KnownLens& lens, const TagFitProblem& problem,
           const std::vector<std::size_t>& members, const TagFit& fit_of_members,
           std::size_t index) {
  std::vector<std::size_t> joined = members;
  joined.insert(std::upper_bound(joined.begin(), joined.end(), index), index);
  TagFitProblem with = Only(problem, joined);
  with.start = fit_of_members.X_CK;
  const auto fit = FitTags(lens.lens, with, {.pose = true});
  return fit && statistics::ChiSquareTail(std::max(0.0, fit->chi2 - fit_of_members.chi2),
                                          kCoordinatesOfTag) >= kSignificance;
}

/// Starts from the tags that agree with the problem's start and removes the worst until the rest
/// agree; then adds those that agree with the rest.
/// @return  nullopt if no majority agrees
std::optional<Majority> FindMajority(const lens::KnownLens& lens, const TagFitProblem& problem) {
  const std::size_t all = problem.observations.size();
  std::vector<std::size_t> members;
  for (std::size_t i = 0; i < all; ++i) {
    const auto alone = FitTags(lens.lens, Only(problem, {i}), {});
    if (IsAccepted(alone)) members.push_back(i);
  }
  if (!IsMajority(members.size(), all)) {
    members.resize(all);
    std::iota(members.begin(), members.end(), std::size_t{0});
  }
  std::optional<TagFit> fit = FitTags(lens.lens, Only(problem, members), {.pose = true});
  while (!IsAccepted(fit) && IsMajority(members.size() - 1, all)) {
    std::optional<TagFit> best;
    std::size_t worst = 0;
    for (std::size_t k = 0; k < members.size(); ++k) {
      std::vector<std::size_t> others = members;
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(k));
      const auto without = FitTags(lens.lens, Only(problem, others), {.pose = true});
      if (without && (!best || without->chi2 < best->chi2)) best = without, worst = k;
    }
    if (!best) return std::nullopt;
    members.erase(members.begin() + static_cast<std::ptrdiff_t>(worst));
    fit = best;
  }
  if (!IsAccepted(fit) || !IsMajority(members.size(), all)) return std::nullopt;
  Majority majority{members, *fit};
  for (std::size_t i = 0; i < all; ++i) {
    if (std::binary_search(members.begin(), members.end(), i)) continue;
    if (!Joins(lens, problem, members, *fit, i)) continue;
    majority.members.insert(std::upper_bound(majority.members.begin(), majority.members.end(), i),
                            i);
  }
  const auto joined = FitTags(lens.lens, Only(problem, majority.members), {.pose = true});
  if (IsAccepted(joined)) {
    majority.fit = *joined;
  } else {
    majority.members = members;
  }
  return majority;
}

/// For each tag outside the majority: the clockwise quarter turns about its centre with which it
/// joins, by id; a tag that does not join in any orientation has no entry.
std::map<int, int> QuarterTurns(const lens::KnownLens& lens, const TagFitProblem& problem,
                                const Majority& majority) {
  std::map<int, int> turns;
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    if (std::binary_search(majority.members.begin(), majority.members.end(), i)) continue;
    for (const int quarters : {2, 1, 3}) {
      TagFitProblem turned = problem;
      for (std::size_t k = 0; k < 4; ++k) {
        turned.observations[i].pixels[k] = problem.observations[i].pixels[(k + quarters) % 4];
      }
      if (!Joins(lens, turned, majority.members, majority.fit, i)) continue;
      turns[problem.observations[i].id] = quarters;
      break;
    }
  }
  return turns;
}

constexpr std::size_t kMinTagsToExclude = 3;

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
  judgement.turned_rad = AngleBetween(problem.start, moved->X_CK);
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

/// Tests whether a majority of the tags did not move. Each tag is tested on its own, since the
/// camera's pose is known.
bool SomeTagsMoved(const lens::KnownLens& lens, const TagFitProblem& problem,
                   TagTestResult& judgement) {
  std::vector<std::size_t> members;
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    if (IsAccepted(FitTags(lens.lens, Only(problem, {i}), {}))) members.push_back(i);
  }
  if (!IsMajority(members.size(), problem.observations.size())) return false;
  const auto fit = FitTags(lens.lens, Only(problem, members), {});
  if (!IsAccepted(fit)) return false;
  Accept(*fit, TagTestOutcome::kGood, judgement);
  judgement.excluded = IdsExcept(problem, members);
  return true;
}

std::vector<int> IdsOf(const TagFitProblem& problem) {
  return IdsExcept(problem, {});
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
  if (CameraMoved(lens, problem, judgement) || OneTagMoved(lens, problem, {}, judgement) ||
      SomeTagsMoved(lens, problem, judgement)) {
    return judgement;
  }
  judgement.verdict = TagTestOutcome::kBad;
  judgement.unresolved = IdsOf(problem);
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
  if (IsAccepted(fit)) return judgement;
  // If another focal length explains all tags, the lens is wrong and not the tags.
  const bool zoomed = IsAccepted(FitTags(lens.lens, problem, {.pose = true, .focal = true}));
  const auto majority = zoomed ? std::nullopt : FindMajority(lens, problem);
  if (majority) {
    Accept(majority->fit, TagTestOutcome::kGood, judgement);
    judgement.rms_px = majority->fit.rms_px;
    judgement.excluded = IdsExcept(problem, majority->members);
    judgement.quarter_turns = QuarterTurns(lens, problem, *majority);
    return judgement;
  }
  judgement.verdict = TagTestOutcome::kBad;
  judgement.unresolved = IdsOf(problem);
  return judgement;
}

/// Tests the visible tags that are not in the baseline against those that are.
void JudgeTagsOutsideBaseline(const lens::KnownLens& lens, const target::Body& cell,
                              const std::vector<SeenTag>& seen, const TagBaseline& baseline,
                              const TagCheckSettings& settings, TagTestResult& judgement) {
  const std::vector<TagObservation> observations = ObservedReferenceTags(cell, seen);
  const auto in_baseline = [&](const TagObservation& one) {
    return baseline.tags.count(one.id) > 0 &&
           std::ranges::find(judgement.excluded, one.id) == judgement.excluded.end();
  };
  const auto trusted = std::ranges::count_if(observations, in_baseline);
  const bool some_are_new = std::ranges::any_of(
      observations, [&](const TagObservation& one) { return baseline.tags.count(one.id) == 0; });
  if (!some_are_new || trusted < static_cast<std::ptrdiff_t>(kMinTagsForPose)) return;
  auto problem = ProblemWithoutBaseline(lens, lens.covariance, cell, seen, settings);
  if (!problem) return;
  problem->start = judgement.X_CK;
  Majority majority;
  for (std::size_t i = 0; i < problem->observations.size(); ++i) {
    if (in_baseline(problem->observations[i])) majority.members.push_back(i);
  }
  const auto fit = FitTags(lens.lens, Only(*problem, majority.members), {.pose = true});
  if (!IsAccepted(fit)) return;
  majority.fit = *fit;
  for (std::size_t i = 0; i < problem->observations.size(); ++i) {
    const int id = problem->observations[i].id;
    if (baseline.tags.count(id) == 0 && !Joins(lens, *problem, majority.members, *fit, i)) {
      judgement.excluded.push_back(id);
    }
  }
  std::ranges::sort(judgement.excluded);
  if (judgement.excluded.empty()) return;
  judgement.quarter_turns = QuarterTurns(lens, *problem, majority);
  std::erase_if(judgement.quarter_turns, [&](const auto& turned) {
    return !std::binary_search(judgement.excluded.begin(), judgement.excluded.end(), turned.first);
  });
}

TagTestResult TestAsSeen(const lens::KnownLens& lens, const target::Body& cell,
                         const std::vector<SeenTag>& seen, const TagBaseline* baseline,
                         const TagCheckSettings& settings) {
  if (baseline == nullptr) {
    const auto problem = ProblemWithoutBaseline(lens, lens.covariance, cell, seen, settings);
    return problem ? JudgeWithoutBaseline(lens, *problem) : TagTestResult{};
  }
  const TagFitProblem problem = ProblemAgainstBaseline(cell, seen, *baseline, settings);
  if (problem.observations.empty()) return {};
  TagTestResult judgement = JudgeAgainstBaseline(lens, problem);
  if (judgement.verdict == TagTestOutcome::kGood) {
    JudgeTagsOutsideBaseline(lens, cell, seen, *baseline, settings, judgement);
  }
  return judgement;
}

}  // namespace

TagTestResult TestReferenceTags(const lens::KnownLens& lens, const target::Body& cell,
                                const std::vector<SeenTag>& seen, const TagBaseline* baseline,
                                const TagCheckSettings& settings) {
  TagTestResult judgement = TestAsSeen(lens, cell, seen, baseline, settings);
  const std::size_t tags = ObservedReferenceTags(cell, seen).size();
  const bool bad = judgement.verdict == TagTestOutcome::kBad;
  const bool mostly_turned = 2 * judgement.excluded.size() > tags;
  if (tags < kMinTagsForPose || (!bad && !mostly_turned)) return judgement;
  std::vector<SeenTag> turned = seen;
  for (SeenTag& tag : turned) tag = Turned(tag, 2);
  const TagTestResult other = TestAsSeen(lens, cell, turned, baseline, settings);
  if (other.verdict != TagTestOutcome::kGood || !IsMajority(tags - other.excluded.size(), tags)) {
    return judgement;
  }
  judgement = {};
  judgement.verdict = TagTestOutcome::kBad;
  judgement.all_turned = true;
  judgement.rms_px = other.rms_px;
  return judgement;
}

TagBaseline BaselineAt(const lens::KnownLens& lens, const target::Body& cell,
                       const std::vector<SeenTag>& seen, const Pose& X_CK) {
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
                                                 const target::Body& cell,
                                                 const std::vector<SeenTag>& seen,
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

}  // namespace plumbline::vision
