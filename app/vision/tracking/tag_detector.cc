#include "app/vision/tracking/tag_detector.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "app/vision/tracking/decode.h"
#include "app/vision/tracking/edge_alignment.h"
#include "app/vision/tracking/quads.h"
#include "firmware-like/image/luma_view.h"
#include "firmware-like/lens/lens.h"

namespace plumbline::vision {
namespace {

constexpr int kMinImage_px = 12;
constexpr double kMinReducedCell_px = 4;  // of a tag that is searched in a reduced image
// Bounding box of the tags that are searched at full resolution.
constexpr int kMinSmallTag_px = 9, kMaxSmallTag_px = 44;
/// Side of a cell below which the corners are refined before the tag is given up as unreadable.
constexpr double kFewPixels = 3.25;
/// Largest number of wrong cells that more exact corners may correct; 8 % of random cells of 36h11
/// have no more.
constexpr int kMostWrongBits = 6;
constexpr double kAligned_px = 0.35;  // least standard deviation of corners by AlignWithEdges()
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
      // A second reading is a second chance for random cells inside a dark frame.
      most_border_(family_.strict ? 1 : 2),
      settings_(settings),
      threshold_(settings.threshold),
      quads_({.max_regions = settings.max_regions}) {
  family_.strict &= settings.strict;
}

struct TagDetector::FoundTag {
  SeenTag tag;
  bool exact;  ///< its corners are refined
};

struct TagDetector::Decoded {
  target::TagCode code;
  double contrast;
  int cells;  ///< per side, including the border
};

std::optional<TagDetector::Decoded> TagDetector::Decode(const image::LumaView& image,
                                                        const Corners& corners,
                                                        int most_wrong_bits) const {
  for (int border = 1; border <= most_border_; ++border) {
    const auto read = ReadCells(image, family_, border, corners, threshold_.min_range());
    if (!read) return std::nullopt;
    const auto code = target::NearestTag(family_, read->bits, most_wrong_bits);
    if (code) return Decoded{*code, read->contrast, family_.data_cells + 2 * border};
  }
  return std::nullopt;
}

/// Verifies and decodes one quadrilateral.
std::optional<TagDetector::FoundTag> TagDetector::TagAt(const image::LumaView& image,
                                                        double reach_px, Corners corners,
                                                        const lens::Lens* lens) const {
  EdgeSearch edges;
  edges.min_step = 0.4 * threshold_.min_range();
  edges.reach_px = reach_px;
  const auto sides = AlignWithEdges(image, edges, corners);
  if (!sides) return std::nullopt;
  const double side_px = ShortestSide(corners);
  const auto is_small = [side_px](int cells) { return side_px < kFewPixels * cells; };
  auto decoded = Decode(image, corners, family_.correctable_bits);
  int cells = decoded ? decoded->cells : 0;
  if (!decoded) {
    if (!is_small(family_.data_cells + 2 * most_border_)) return std::nullopt;
    const auto nearly = Decode(image, corners, kMostWrongBits);
    if (!nearly || !is_small(nearly->cells)) return std::nullopt;
    cells = nearly->cells;
  }
  auto refined = RefineCorners(image, corners, sides->hidden, cells, lens);
  const bool exact = refined.has_value();
  if (!refined) {
    if (!decoded) return std::nullopt;
    // Too few pixels for the fit, or too much of the cells in the blurred edge.
    const double sd_px = std::max(kAligned_px, sides->scatter_px);
    refined = RefinedCorners{corners, sd_px * sd_px * CornersCovariance::Identity()};
  }
  if (!decoded) decoded = Decode(image, refined->corners, family_.correctable_bits);
  if (!decoded) return std::nullopt;
  const target::TagCode& code = decoded->code;
  return FoundTag{
      Turned({code.id, code.wrong_bits, refined->corners, refined->covariance, decoded->contrast},
             code.turns),
      exact};
}

void TagDetector::Search(const image::LumaView& image, const Part& part, bool whole,
                         const lens::Lens* lens, SeenTags& seen) {
  const ImageBox box = WithinImage(part.box, image.size());
  if (std::min(box.width(), box.height()) < kMinImage_px) return;
  MakeSearchImage(image, box, part.reduction, search_);
  for (SearchImage& level : coarser_) level.width = 0;
  threshold_.Apply(search_, whole);
  found_.clear();
  QuadFinder::Limits limits{.max_regions = settings_.max_regions};
  if (whole && search_.shrink == 1) {  // larger ones are found at half the resolution
    limits.min_side = kMinSmallTag_px;
    limits.max_side = kMaxSmallTag_px;
  }
  quads_.Find(search_, limits, found_);
  seen.limited |= quads_.limited();
  if (!settings_.threshold) {
    segments_.clear();
    segment_finder_.Find(search_, {.min_step = threshold_.min_range()}, segments_);
    line_quads_.Find(search_, segments_, found_);
  }
  for (const Corners& corners : found_) {
    const auto tag = TagAtAnyLevel(image, part, corners, lens);
    if (!tag) continue;
    const auto same =
        std::ranges::find_if(seen.tags, [&](const SeenTag& other) { return SameTag(*tag, other); });
    if (same == seen.tags.end()) {
      seen.tags.push_back(*tag);
    } else if (std::pair(tag->wrong_bits, tag->covariance.trace()) <
               std::pair(same->wrong_bits, same->covariance.trace())) {
      *same = *tag;
    }
  }
}

/// Verifies and decodes one quadrilateral at the finest resolution at which that succeeds: a large
/// tag out of focus looks like a small sharp one in a reduced image.
std::optional<SeenTag> TagDetector::TagAtAnyLevel(const image::LumaView& image, const Part& part,
                                                  const Corners& corners, const lens::Lens* lens) {
  const double cell_px = ShortestSide(corners) / family_.cells();
  // Stay within the border: the edges of the data cells are a cell further in.
  const double reach_px = std::clamp(0.8 * cell_px, 2.0, 2.0 * search_.shrink);
  auto found = TagAt(image, reach_px, corners, lens);
  const SearchImage* level = part.reduction == Reduction::kHalf ? &search_ : nullptr;
  for (std::size_t k = 0; level != nullptr && !(found && found->exact) &&
                          cell_px >= kMinReducedCell_px * level->shrink;
       ++k) {
    const image::LumaView view{level->grey.data(), level->width, level->height, level->width};
    Corners reduced;
    for (int c = 0; c < 4; ++c) reduced[c] = level->PixelOf(corners[c]);
    const double reach = std::clamp(0.8 * cell_px / level->shrink, 2.0, 4.0);
    const auto reduced_lens = lens != nullptr ? std::optional(level->LensOf(*lens)) : std::nullopt;
    auto there = TagAt(view, reach, reduced, reduced_lens ? &*reduced_lens : nullptr);
    if (there) {
      found = there;
      for (auto& corner : found->tag.corners_px) {
        corner = level->ImagePixel(corner.x(), corner.y());
      }
      found->tag.covariance *= level->shrink * level->shrink;
    }
    if (k == coarser_.size()) break;
    if (coarser_[k].width == 0) MakeCoarser(*level, coarser_[k]);
    level = &coarser_[k];
  }
  return found ? std::optional(found->tag) : std::nullopt;
}

void TagDetector::Detect(const image::LumaView& image, const lens::Lens* lens, SeenTags& seen) {
  seen.tags.clear();
  seen.limited = false;
  const ImageBox whole{0, 0, image.width, image.height};
  Search(image, {whole, Reduction::kHalf}, true, lens, seen);
  if (settings_.small_tags) {
    const bool noisy = threshold_.min_range() >= kNoisyRange;
    Search(image, {whole, Reduction::kNone}, true, lens, seen);
    if (noisy) Search(image, {whole, Reduction::kSmooth}, true, lens, seen);
  }
  std::ranges::stable_sort(seen.tags,
                           [](const SeenTag& a, const SeenTag& b) { return a.id < b.id; });
}

void TagDetector::DetectIn(const image::LumaView& image, const std::vector<Part>& parts,
                           const lens::Lens* lens, SeenTags& seen) {
  seen.tags.clear();
  seen.limited = false;
  for (const Part& part : parts) Search(image, part, false, lens, seen);
  std::ranges::stable_sort(seen.tags,
                           [](const SeenTag& a, const SeenTag& b) { return a.id < b.id; });
}

}  // namespace plumbline::vision
