#include "app/vision/lens/usable_region.h"

#include <algorithm>

#include "app/vision/lens/projection_uncertainty.h"
#include "firmware-like/lens/known_lens.h"

namespace plumbline::vision {
namespace {

constexpr double kMinUsableShare = 0.5;  // of the image

}  // namespace

RadiusErrors DifferencesWithin(const lens::Lens& a, const lens::Lens& b, image::ImageSize size) {
  RadiusErrors errors_px{};
  for (std::size_t k = 0; k < errors_px.size(); ++k)
    errors_px[k] = LargestDifference(a, b, size, std::nullopt, CandidateRadius(k, size));
  return errors_px;
}

RadiusErrors CountedEverywhere(RadiusErrors error_px) {
  const auto finite = std::ranges::find_if(error_px, [](double px) { return std::isfinite(px); });
  if (finite != error_px.end()) error_px.fill(*finite);
  return error_px;
}

RegionChoice LargestRegion(const lens::Lens& lens, const lens::LensCovariance& covariance,
                           const RadiusErrors& error_px, image::ImageSize size,
                           std::optional<double> distance_m, double acceptable_px) {
  RegionChoice whole;
  for (std::size_t k = 0; k < kCandidateRadii; ++k) {
    RegionChoice choice;
    choice.radius_px = CandidateRadius(k, size);
    lens::KnownLens known;
    known.size = size;
    known.usable_radius_px = choice.radius_px;
    if (lens::UsableShare(known) < kMinUsableShare) break;
    choice.error_px = error_px[k];
    choice.plain_px =
        ProjectionUncertaintyOf(lens, covariance, size, distance_m, choice.radius_px).max_px;
    const double both_px = std::hypot(choice.plain_px, choice.error_px);
    choice.everywhere_px = k == 0 ? both_px : whole.everywhere_px;
    choice.acceptable = both_px <= acceptable_px;
    if (choice.acceptable) return choice;
    if (k == 0) whole = choice;
    whole.least_px = std::min(whole.least_px, both_px);
  }
  return whole;
}

}  // namespace plumbline::vision
