#include "app/vision/tracking/bodies.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace plumbline::vision {
namespace {

constexpr std::size_t kMaxStartTags = 3, kMaxPairTags = 10;
constexpr double kOutlier_px = 0.5, kOutlier_sd = 6, kOutlierPlace_sd = 4;

/// A tag of the body with its detection.
struct Observation {
  const target::BodyTag* on_body;
  const SeenTag* seen;
};

std::vector<Observation> ObservationsOf(const target::Body& body,
                                        const std::vector<SeenTag>& tags) {
  std::vector<Observation> observations;
  for (const target::BodyTag& on_body : body.tags) {
    const SeenTag* seen = nullptr;
    int count = 0;
    for (const SeenTag& tag : tags) {
      if (tag.id == on_body.id) seen = &tag, ++count;
    }
    if (count == 1) observations.push_back({&on_body, seen});
  }
  const auto size = [](const Observation& s) {
    return (s.seen->corners_px[2] - s.seen->corners_px[0]).squaredNorm();
  };
  std::ranges::stable_sort(
      observations, [&](const Observation& a, const Observation& b) { return size(a) > size(b); });
  return observations;
}

std::vector<CornerSet> SetsOf(const std::vector<Observation>& observations) {
  std::vector<CornerSet> sets;
  for (const Observation& observation : observations) {
    CornerSet set{CornersInTag(observation.on_body->side_m), observation.seen->corners_px,
                  observation.seen->covariance};
    for (Vec3& p : set.p_K) p = observation.on_body->X_KM * p;
    sets.push_back(set);
  }
  return sets;
}

/// Whether the corners of a tag are near their projections.
bool Agrees(const lens::KnownLens& lens, const Pose& X_CK, const CornerSet& set,
            double place_sd_m) {
  double square = 0;
  for (int k = 0; k < 4; ++k) {
    const Vec3 p = X_CK * set.p_K[k];
    if (!(p.z() > 0)) return false;
    square += 0.25 * (Project<double>(lens.lens, p) - set.pixels[k]).squaredNorm();
  }
  const double sd = std::sqrt(set.covariance.trace() / 4);
  const double place_sd_px = lens.lens.fx / (X_CK * set.p_K[0]).z() * place_sd_m;
  return std::sqrt(square) <=
         std::max({kOutlier_px, kOutlier_sd * sd, kOutlierPlace_sd * place_sd_px});
}

int CountAgreeing(const lens::KnownLens& lens, const Pose& X_CK, const std::vector<CornerSet>& sets,
                  double place_sd_m) {
  return static_cast<int>(std::ranges::count_if(
      sets, [&](const CornerSet& set) { return Agrees(lens, X_CK, set, place_sd_m); }));
}

/// Index of the tag without which the others agree best.
std::size_t FindOutlier(const lens::KnownLens& lens, const std::vector<CornerSet>& sets,
                        const Pose& start) {
  std::size_t outlier = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < sets.size(); ++i) {
    std::vector<CornerSet> others = sets;
    others.erase(others.begin() + static_cast<long>(i));
    const auto fit = RefinePose(lens, others, start);
    if (fit && fit->chi2 < least) least = fit->chi2, outlier = i;
  }
  return outlier;
}

std::vector<Pose> StartsOf(const lens::KnownLens& lens,
                           const std::vector<Observation>& observations) {
  std::vector<Pose> starts;
  for (std::size_t i = 0; i < std::min(observations.size(), kMaxStartTags); ++i) {
    const target::BodyTag& on_body = *observations[i].on_body;
    const auto poses = PosesOfTag(lens, observations[i].seen->corners_px,
                                  observations[i].seen->covariance, on_body.side_m);
    if (!poses) continue;
    starts.push_back(poses->best.X_CK * on_body.X_KM.Inverse());
    if (poses->other) starts.push_back(poses->other->X_CK * on_body.X_KM.Inverse());
  }
  return starts;
}

/// The tags that agree with the pose of some pair of tags: those of the pair that most agree with.
/// @param observations  the largest tags first
/// @return              indices in ascending order; empty if no pair has a pose that half of all
///                      tags agree with
std::vector<std::size_t> LargestAgreement(const lens::KnownLens& lens,
                                          const std::vector<Observation>& observations,
                                          double place_sd_m) {
  const std::vector<CornerSet> sets = SetsOf(observations);
  std::optional<Pose> best;
  int most = static_cast<int>(sets.size()) / 2;
  const std::size_t count = std::min(sets.size(), kMaxPairTags);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = i + 1; j < count; ++j) {
      const std::vector<Observation> pair = {observations[i], observations[j]};
      const auto poses = BestPoses(lens, SetsOf(pair), StartsOf(lens, pair));
      if (!poses) continue;
      const int agreeing = CountAgreeing(lens, poses->best.X_CK, sets, place_sd_m);
      if (agreeing > most) most = agreeing, best = poses->best.X_CK;
    }
  }
  std::vector<std::size_t> members;
  for (std::size_t k = 0; best && k < sets.size(); ++k) {
    if (Agrees(lens, *best, sets[k], place_sd_m)) members.push_back(k);
  }
  return members;
}

/// Keeps the observations at `members`; the ids of the others are appended to `left_out`.
void Keep(const std::vector<std::size_t>& members, std::vector<Observation>& observations,
          std::vector<int>& left_out) {
  std::vector<Observation> kept;
  for (std::size_t k = 0; k < observations.size(); ++k) {
    if (std::binary_search(members.begin(), members.end(), k)) {
      kept.push_back(observations[k]);
    } else {
      left_out.push_back(observations[k].on_body->id);
    }
  }
  observations = std::move(kept);
}

}  // namespace

std::optional<SeenBody> LocateBody(const lens::KnownLens& lens, const target::Body& body,
                                   const std::vector<SeenTag>& tags,
                                   const std::optional<Pose>& previous) {
  std::vector<Observation> observations = ObservationsOf(body, tags);
  SeenBody seen;
  seen.body = &body;
  std::optional<PosePair> poses;
  const double place_sd_m = body.place_sd_m.value_or(0);
  bool tried_pairs = false;
  while (!observations.empty()) {
    const std::vector<CornerSet> sets = SetsOf(observations);
    std::vector<Pose> starts = StartsOf(lens, observations);
    if (previous) starts.push_back(*previous);
    poses = BestPoses(lens, sets, starts);
    if (!poses) return std::nullopt;
    const std::size_t agreeing = CountAgreeing(lens, poses->best.X_CK, sets, place_sd_m);
    if (observations.size() <= 2 || agreeing == observations.size()) break;
    if (!std::exchange(tried_pairs, true) && 2 * agreeing <= observations.size()) {
      const auto members = LargestAgreement(lens, observations, place_sd_m);
      if (!members.empty()) {
        Keep(members, observations, seen.left_out);
        continue;
      }
    }
    const std::size_t outlier = FindOutlier(lens, sets, poses->best.X_CK);
    seen.left_out.push_back(observations[outlier].on_body->id);
    observations.erase(observations.begin() + static_cast<long>(outlier));
  }
  if (!poses) return std::nullopt;
  seen.estimate = poses->best;
  seen.ambiguous = poses->ambiguous();
  if (seen.ambiguous && previous && poses->other &&
      AngleBetween(poses->other->X_CK, *previous) < AngleBetween(poses->best.X_CK, *previous)) {
    seen.estimate = *poses->other;
  }
  for (const Observation& observation : observations) seen.used.push_back(observation.on_body->id);
  std::ranges::sort(seen.used);
  std::ranges::sort(seen.left_out);
  return seen;
}

}  // namespace plumbline::vision
