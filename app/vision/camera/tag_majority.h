// Largest group of reference tags that agree with each other.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "app/vision/camera/tag_fit.h"

namespace plumbline::vision {

inline constexpr std::size_t kMinTagsForPose = 2;

/// Whether the chi^2 of a fit is not rejected at kSignificance.
bool IsAccepted(const std::optional<TagFit>& fit);

/// Whether `members` tags are enough to outvote the others: more than half of `all`, at least two.
bool IsMajority(std::size_t members, std::size_t all);

/// The observations at `members`, which are in ascending order.
TagFitProblem Only(const TagFitProblem& problem, const std::vector<std::size_t>& members);

/// Ids of the tags that are not among `members`.
std::vector<int> IdsExcept(const TagFitProblem& problem, const std::vector<std::size_t>& members);

/// Whether the tag at `index` agrees with the tags at `members`: the increase of chi^2 is that of
/// its coordinates' noise.
bool Joins(const lens::KnownLens& lens, const TagFitProblem& problem,
           const std::vector<std::size_t>& members, const TagFit& fit_of_members,
           std::size_t index);

/// A majority of the tags that agree with each other, with the camera's pose free.
struct Majority {
  std::vector<std::size_t> members;
  TagFit fit;
};

/// Starts from the tags that agree with the problem's start and removes the worst until the rest
/// agree; then adds those that agree with the rest.
/// @return  nullopt if no majority agrees
std::optional<Majority> FindMajority(const lens::KnownLens& lens, const TagFitProblem& problem);

/// For each tag outside the majority: the clockwise quarter turns about its centre with which it
/// joins, by id; a tag that does not join in any orientation has no entry.
std::map<int, int> QuarterTurns(const lens::KnownLens& lens, const TagFitProblem& problem,
                                const Majority& majority);

}  // namespace plumbline::vision
