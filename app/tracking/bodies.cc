#include "app/tracking/bodies.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace plumbline {
namespace {

constexpr std::size_t kMaxStartTags = 3;
constexpr double kContradicts_px = 0.5, kContradicts_sd = 6, kContradictsPlace_sd = 4;

/// A body's tag as it is seen.
struct Sight {
  const BodyTag* on_body;
  const SeenTag* seen;
};

std::vector<Sight> SightsOf(const Body& body, const std::vector<SeenTag>& tags) {
  std::vector<Sight> sights;
  for (const BodyTag& on_body : body.tags) {
    const SeenTag* seen = nullptr;
    int count = 0;
    for (const SeenTag& tag : tags) {
      if (tag.id == on_body.id) seen = &tag, ++count;
    }
    if (count == 1) sights.push_back({&on_body, seen});
  }
  const auto size = [](const Sight& s) {
    return (s.seen->corners_px[2] - s.seen->corners_px[0]).squaredNorm();
  };
  std::stable_sort(sights.begin(), sights.end(),
                   [&](const Sight& a, const Sight& b) { return size(a) > size(b); });
  return sights;
}

std::vector<CornerSet> SetsOf(const std::vector<Sight>& sights) {
  std::vector<CornerSet> sets;
  for (const Sight& sight : sights) {
    CornerSet set{CornersInTag(sight.on_body->side_m), sight.seen->corners_px,
                  sight.seen->covariance};
    for (Vec3& p : set.p_K) p = sight.on_body->X_KM * p;
    sets.push_back(set);
  }
  return sets;
}

/// Whether some tag's corners are too far from where the pose puts them.
bool SomeContradicts(const KnownLens& lens, const Pose& X_CK, const std::vector<CornerSet>& sets,
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
           std::max({kContradicts_px, kContradicts_sd * sd, kContradictsPlace_sd * place_sd_px});
  });
}

/// The tag without which the others agree best.
std::size_t OddOne(const KnownLens& lens, const std::vector<CornerSet>& sets, const Pose& start) {
  std::size_t odd = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < sets.size(); ++i) {
    std::vector<CornerSet> others = sets;
    others.erase(others.begin() + static_cast<long>(i));
    const auto fit = RefinePose(lens, others, start);
    if (fit && fit->chi2 < least) least = fit->chi2, odd = i;
  }
  return odd;
}

std::vector<Pose> StartsOf(const KnownLens& lens, const std::vector<Sight>& sights) {
  std::vector<Pose> starts;
  for (std::size_t i = 0; i < std::min(sights.size(), kMaxStartTags); ++i) {
    const BodyTag& on_body = *sights[i].on_body;
    const auto poses =
        PosesOfTag(lens, sights[i].seen->corners_px, sights[i].seen->covariance, on_body.side_m);
    if (!poses) continue;
    starts.push_back(poses->best.X_CK * on_body.X_KM.Inverse());
    if (poses->other) starts.push_back(poses->other->X_CK * on_body.X_KM.Inverse());
  }
  return starts;
}

}  // namespace

std::optional<double> TagDatabase::SideOf(int id) const {
  for (const LoneTag& tag : tags) {
    if (tag.id == id) return tag.side_m;
  }
  for (const Body& body : bodies) {
    for (const BodyTag& tag : body.tags) {
      if (tag.id == id) return tag.side_m;
    }
  }
  return other_side_m;
}

const Body* TagDatabase::BodyOf(int id) const {
  for (const Body& body : bodies) {
    for (const BodyTag& tag : body.tags) {
      if (tag.id == id) return &body;
    }
  }
  return nullptr;
}

std::optional<SeenBody> LocateBody(const KnownLens& lens, const Body& body,
                                   const std::vector<SeenTag>& tags,
                                   const std::optional<Pose>& previous) {
  std::vector<Sight> sights = SightsOf(body, tags);
  SeenBody seen;
  seen.body = &body;
  std::optional<PosePair> poses;
  while (!sights.empty()) {
    const std::vector<CornerSet> sets = SetsOf(sights);
    std::vector<Pose> starts = StartsOf(lens, sights);
    if (previous) starts.push_back(*previous);
    poses = BestPoses(lens, sets, starts);
    if (!poses) return std::nullopt;
    if (sights.size() <= 2 ||
        !SomeContradicts(lens, poses->best.X_CK, sets, body.place_sd_m.value_or(0)))
      break;
    const std::size_t odd = OddOne(lens, sets, poses->best.X_CK);
    seen.left_out.push_back(sights[odd].on_body->id);
    sights.erase(sights.begin() + static_cast<long>(odd));
  }
  if (!poses) return std::nullopt;
  seen.estimate = poses->best;
  seen.ambiguous = poses->ambiguous();
  if (seen.ambiguous && previous && poses->other &&
      AngleBetween(poses->other->X_CK, *previous) < AngleBetween(poses->best.X_CK, *previous)) {
    seen.estimate = *poses->other;
  }
  for (const Sight& sight : sights) seen.used.push_back(sight.on_body->id);
  std::sort(seen.used.begin(), seen.used.end());
  std::sort(seen.left_out.begin(), seen.left_out.end());
  return seen;
}

}  // namespace plumbline
