#include "app/vision/camera/tag_majority.h"

#include <algorithm>
#include <numeric>

#include "firmware-like/statistics/chi_square.h"

namespace plumbline::vision {
namespace {

constexpr int kCoordinatesOfTag = 8;

}  // namespace

bool IsAccepted(const std::optional<TagFit>& fit) {
  return fit && statistics::ChiSquareTail(fit->chi2, std::max(1, fit->degrees_of_freedom)) >=
                    kSignificance;
}

bool IsMajority(std::size_t members, std::size_t all) {
  return members >= kMinTagsForPose && 2 * members > all;
}

TagFitProblem Only(const TagFitProblem& problem, const std::vector<std::size_t>& members) {
  TagFitProblem some = problem;
  for (std::size_t i = problem.observations.size(); i-- > 0;) {
    if (!std::binary_search(members.begin(), members.end(), i)) some = some.Without(i);
  }
  return some;
}

std::vector<int> IdsExcept(const TagFitProblem& problem, const std::vector<std::size_t>& members) {
  std::vector<int> ids;
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    if (!std::binary_search(members.begin(), members.end(), i)) {
      ids.push_back(problem.observations[i].id);
    }
  }
  return ids;
}

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

}  // namespace plumbline::vision
