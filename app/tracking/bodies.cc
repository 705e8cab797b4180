#include "app/tracking/bodies.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace plumbline::tracking {
namespace {

constexpr std::size_t kMaxStartTags = 3;
constexpr double kOutlier_px = 0.5, kOutlier_sd = 6, kOutlierPlace_sd = 4;

/// A tag of the body with its detection.
struct Observation {
  const BodyTag* on_body;
  const SeenTag* seen;
};

std::vector<Observation> ObservationsOf(const Body& body, const std::vector<SeenTag>& tags) {
  std::vector<Observation> observations;
  for (const BodyTag& on_body : body.tags) {
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
  std::stable_sort(observations.begin(), observations.end(),
                   [&](const Observation& a, const Observation& b) { return size(a) > size(b); });
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

/// Whether the corners of some tag are too far from their projections.
bool HasOutlier(const lens::KnownLens& lens, const Pose& X_CK, const std::vector<CornerSet>& sets,
                double place_sd_m) {
  return std::any_of(sets.begin(), sets.end(), [&](const CornerSet& set) {
    double square = 0;
    for (int k = 0; k < 4; ++k) {
      square +=
          0.25 * (Project<double>(lens.lens, X_CK * set.p_K[k]) - set.pixels[k]).squaredNorm();
    }
    const double sd = std::sqrt(set.covariance.trace() / 4);
    const double place_sd_px = lens.lens.fx / (X_CK * set.p_K[0]).z() * place_sd_m;
    return std::sqrt(square) >
           std::max({kOutlier_px, kOutlier_sd * sd, kOutlierPlace_sd * place_sd_px});
  });
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
    const BodyTag& on_body = *observations[i].on_body;
    const auto poses = PosesOfTag(lens, observations[i].seen->corners_px,
                                  observations[i].seen->covariance, on_body.side_m);
    if (!poses) continue;
    starts.push_back(poses->best.X_CK * on_body.X_KM.Inverse());
    if (poses->other) starts.push_back(poses->other->X_CK * on_body.X_KM.Inverse());
  }
  return starts;
}

}  // namespace

std::optional<double> TagDatabase::SideOf(int id) const {
  for (const StandaloneTag& tag : tags) {
    if (tag.id == id) return tag.side_m;
  }
  for (const Body& body : bodies) {
    for (const BodyTag& tag : body.tags) {
      if (tag.id == id) return tag.side_m;
    }
  }
  return default_side_m;
}

const Body* TagDatabase::BodyOf(int id) const {
  for (const Body& body : bodies) {
    for (const BodyTag& tag : body.tags) {
      if (tag.id == id) return &body;
    }
  }
  return nullptr;
}

std::optional<SeenBody> LocateBody(const lens::KnownLens& lens, const Body& body,
                                   const std::vector<SeenTag>& tags,
                                   const std::optional<Pose>& previous) {
  std::vector<Observation> observations = ObservationsOf(body, tags);
  SeenBody seen;
  seen.body = &body;
  std::optional<PosePair> poses;
  while (!observations.empty()) {
    const std::vector<CornerSet> sets = SetsOf(observations);
    std::vector<Pose> starts = StartsOf(lens, observations);
    if (previous) starts.push_back(*previous);
    poses = BestPoses(lens, sets, starts);
    if (!poses) return std::nullopt;
    if (observations.size() <= 2 ||
        !HasOutlier(lens, poses->best.X_CK, sets, body.place_sd_m.value_or(0)))
      break;
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
  std::sort(seen.used.begin(), seen.used.end());
  std::sort(seen.left_out.begin(), seen.left_out.end());
  return seen;
}

}  // namespace plumbline::tracking
