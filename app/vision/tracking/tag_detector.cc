#include "app/vision/tracking/tag_detector.h"

#include <algorithm>
#include <utility>

#include "app/vision/tracking/decode.h"
#include "app/vision/tracking/edge_search.h"

namespace plumbline::vision {
namespace {

constexpr int kMinImage_px = 12;
// Bounding box of the tags that are searched at full resolution.
constexpr int kMinSmallTag_px = 9, kMaxSmallTag_px = 44;
/// Side of a cell below which the corners are refined before the tag is given up as unreadable.
constexpr double kFewPixels = 3.25;
/// Largest number of wrong cells that more exact corners may correct; 8 % of random cells of 36h11
/// have no more.
constexpr int kMostWrongBits = 6;
constexpr double kSnapped_px = 0.35;  // standard deviation of the corners after SnapToEdges()
/// Smallest range that counts as an edge at half the resolution, above which the image is so noisy
/// that the search at full resolution needs a smoothed one [grey levels].
constexpr int kNoisyRange = 13;

double ShortestSide(const Corners& corners) {
  double least = (corners[1] - corners[0]).norm();
  for (int k = 1; k < 4; ++k) least = std::min(least, (corners[(k + 1) % 4] - corners[k]).norm());
  return least;
}

/// Whether both are the same tag: detected in two parts of the image, or as the inner and outer
/// outline of its border.
bool SameTag(const SeenTag& a, const SeenTag& b) {
  lens::Vec2 between = lens::Vec2::Zero();
  for (int k = 0; k < 4; ++k) between += 0.25 * (a.corners_px[k] - b.corners_px[k]);
  return a.id == b.id && between.norm() < 0.5 * ShortestSide(a.corners_px);
}

}  // namespace

SeenTag Turned(const SeenTag& tag, int quarters) {
  SeenTag turned = tag;
  for (Eigen::Index i = 0; i < 4; ++i) {
    const Eigen::Index from = (i + quarters) % 4;
    turned.corners_px[i] = tag.corners_px[from];
    for (Eigen::Index j = 0; j < 4; ++j) {
      turned.covariance.block<2, 2>(2 * i, 2 * j) =
          tag.covariance.block<2, 2>(2 * from, 2 * ((j + quarters) % 4));
    }
  }
  return turned;
}

TagDetector::TagDetector(target::TagFamily family, const DetectorSettings& settings)
    : family_(std::move(family)),
      settings_(settings),
      threshold_(settings.threshold),
      quads_({.max_regions = settings.max_regions}) {
  family_.strict &= settings.strict;
}

/// Verifies and decodes one quadrilateral.
std::optional<SeenTag> TagDetector::TagAt(const image::LumaView& image, double reach_px,
                                          Corners corners, const lens::Lens* lens) const {
  EdgeSearch edges;
  edges.min_step = 0.4 * threshold_.min_range();
  edges.reach_px = reach_px;
  if (!SnapToEdges(image, edges, corners)) return std::nullopt;
  const bool small = ShortestSide(corners) < kFewPixels * family_.cells();
  const double contrast = threshold_.min_range();
  auto cells = ReadCells(image, family_, corners, contrast);
  if (!cells) return std::nullopt;
  auto code = target::NearestTag(family_, cells->bits);
  if (!code && !(small && target::NearestTag(family_, cells->bits, kMostWrongBits)))
    return std::nullopt;
  auto refined = RefineCorners(image, corners, family_.cells(), lens);
  if (!refined) {
    if (!small || !code) return std::nullopt;
    // A small tag may have too few pixels for the fit.
    refined = RefinedCorners{corners, kSnapped_px * kSnapped_px * CornersCovariance::Identity()};
  }
  if (!code) {
    cells = ReadCells(image, family_, refined->corners, contrast);
    if (cells) code = target::NearestTag(family_, cells->bits);
  }
  if (!code) return std::nullopt;
  return Turned(
      {code->id, code->wrong_bits, refined->corners, refined->covariance, cells->contrast},
      code->turns);
}

void TagDetector::Search(const image::LumaView& image, const Part& part, bool whole,
                         const lens::Lens* lens, SeenTags& seen) {
  const ImageBox box = WithinImage(part.box, image.size());
  if (std::min(box.width(), box.height()) < kMinImage_px) return;
  MakeSearchImage(image, box, part.reduction, search_);
  threshold_.Apply(search_, whole);
  found_.clear();
  QuadFinder::Limits limits{.max_regions = settings_.max_regions};
  if (whole && search_.shrink == 1) {  // larger ones are found at half the resolution
    limits.min_side = kMinSmallTag_px;
    limits.max_side = kMaxSmallTag_px;
  }
  quads_.Find(search_, limits, found_);
  seen.limited |= quads_.limited();
  for (const Corners& corners : found_) {
    // Stay within the border: the edges of the data cells are a cell further in.
    const double reach_px =
        std::clamp(0.8 * ShortestSide(corners) / family_.cells(), 2.0, 2.0 * search_.shrink);
    const auto tag = TagAt(image, reach_px, corners, lens);
    if (!tag) continue;
    const auto same = std::find_if(seen.tags.begin(), seen.tags.end(),
                                   [&](const SeenTag& other) { return SameTag(*tag, other); });
    if (same == seen.tags.end()) {
      seen.tags.push_back(*tag);
    } else if (tag->wrong_bits < same->wrong_bits) {
      *same = *tag;
    }
  }
}

void TagDetector::Detect(const image::LumaView& image, const lens::Lens* lens, SeenTags& seen) {
  seen.tags.clear();
  seen.limited = false;
  const ImageBox whole{0, 0, image.width, image.height};
  Search(image, {whole, Reduction::kHalf}, true, lens, seen);
  if (settings_.small_tags) {
    const bool noisy = threshold_.min_range() >= kNoisyRange;
    Search(image, {whole, noisy ? Reduction::kSmooth : Reduction::kNone}, true, lens, seen);
  }
  std::stable_sort(seen.tags.begin(), seen.tags.end(),
                   [](const SeenTag& a, const SeenTag& b) { return a.id < b.id; });
}

void TagDetector::DetectIn(const image::LumaView& image, const std::vector<Part>& parts,
                           const lens::Lens* lens, SeenTags& seen) {
  seen.tags.clear();
  seen.limited = false;
  for (const Part& part : parts) Search(image, part, false, lens, seen);
  std::stable_sort(seen.tags.begin(), seen.tags.end(),
                   [](const SeenTag& a, const SeenTag& b) { return a.id < b.id; });
}

}  // namespace plumbline::vision
