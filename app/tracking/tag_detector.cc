#include "app/tracking/tag_detector.h"

#include <algorithm>
#include <utility>

#include "app/tracking/decode.h"
#include "app/tracking/edge_search.h"

namespace plumbline::tracking {
namespace {

constexpr int kMinImage_px = 12;

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

TagDetector::TagDetector(TagFamily family, const DetectorSettings& settings)
    : family_(std::move(family)),
      settings_(settings),
      threshold_(settings.threshold),
      quads_({.max_regions = settings.max_regions}) {}

void TagDetector::Search(const image::LumaView& image, const Part& part, bool whole,
                         const lens::Lens* lens, SeenTags& seen) {
  const ImageBox box = WithinImage(part.box, image.size());
  if (std::min(box.width(), box.height()) < kMinImage_px) return;
  MakeSearchImage(image, box, part.shrink, search_);
  threshold_.Apply(search_, whole);
  found_.clear();
  quads_.Find(search_, found_);
  seen.limited |= quads_.limited();
  EdgeSearch edges;
  edges.min_step = 0.4 * threshold_.min_range();
  for (Corners& corners : found_) {
    // Stay within the border: the edges of the data cells are a cell further in.
    edges.reach_px =
        std::clamp(0.8 * ShortestSide(corners) / family_.cells(), 2.0, 2.0 * part.shrink);
    if (!SnapToEdges(image, edges, corners)) continue;
    const auto read = DecodeCells(image, family_, corners, threshold_.min_range());
    if (!read) continue;
    const auto refined = RefineCorners(image, corners, family_.cells(), lens);
    if (!refined) continue;
    const SeenTag tag = Turned({read->code.id, read->code.wrong_bits, refined->corners,
                                refined->covariance, read->contrast},
                               read->code.turns);
    const auto same = std::find_if(seen.tags.begin(), seen.tags.end(),
                                   [&](const SeenTag& other) { return SameTag(tag, other); });
    if (same == seen.tags.end()) {
      seen.tags.push_back(tag);
    } else if (tag.wrong_bits < same->wrong_bits) {
      *same = tag;
    }
  }
}

void TagDetector::Detect(const image::LumaView& image, const lens::Lens* lens, SeenTags& seen) {
  seen.tags.clear();
  seen.limited = false;
  const ImageBox whole{0, 0, image.width, image.height};
  Search(image, {whole, 2}, true, lens, seen);
  if (settings_.small_tags) Search(image, {whole, 1}, true, lens, seen);
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

}  // namespace plumbline::tracking
