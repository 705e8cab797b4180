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
/// Sharpness of edges from which on a reduced image would show no more.
constexpr double kSharp = 0.45;
/// And from which on neighbouring cells are hardly mixed.
constexpr double kUnmixed = 0.6;
constexpr double kAlike_px = 1.5;  // between corners of the same quadrilateral, in the search image
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

/// Whether a detection has fewer wrong bits, or as many and better known corners.
bool MoreExact(const SeenTag& tag, const SeenTag& than) {
  return std::pair(tag.wrong_bits, tag.covariance.trace()) <
         std::pair(than.wrong_bits, than.covariance.trace());
}

/// Marks the tiles of a tag, and a little around it, as without contrast.
void IgnoreWithin(SearchImage& search, const Corners& corners_px) {
  constexpr double kAround = 1.5 * SearchImage::kTile;
  Corners corners;
  for (int k = 0; k < 4; ++k) corners[k] = search.PixelOf(corners_px[k]);
  const auto [left, right] = std::ranges::minmax(corners, {}, [](const auto& p) { return p.x(); });
  const auto [top, bottom] = std::ranges::minmax(corners, {}, [](const auto& p) { return p.y(); });
  const int columns = search.tile_columns();
  const int rows = static_cast<int>(search.contrast.size()) / std::max(1, columns);
  const auto tile = [](double px, int count) {
    return std::clamp(static_cast<int>(px / SearchImage::kTile), 0, count);
  };
  for (int r = tile(top.y() - kAround, rows); r < tile(bottom.y() + kAround, rows - 1) + 1; ++r) {
    for (int c = tile(left.x() - kAround, columns); c < tile(right.x() + kAround, columns - 1) + 1;
         ++c) {
      const lens::Vec2 middle = SearchImage::kTile * lens::Vec2(c + 0.5, r + 0.5);
      bool inside = true;
      for (int k = 0; k < 4 && inside; ++k) {
        const lens::Vec2 side = (corners[(k + 1) % 4] - corners[k]).normalized();
        const lens::Vec2 outwards(side.y(), -side.x());
        inside = outwards.dot(middle - corners[k]) < kAround;
      }
      if (inside) search.contrast[static_cast<std::size_t>(r) * columns + c] = 0;
    }
  }
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

struct TagDetector::Decoded {
  target::TagCode code;
  double contrast;
  int cells;  ///< per side, including the border
};

/// The code with the fewest wrong cells, at most kMostWrongBits.
std::optional<TagDetector::Decoded> TagDetector::Decode(const image::LumaView& image,
                                                        const Corners& corners,
                                                        bool blurred) const {
  std::optional<Decoded> best;
  for (int border = 1; border <= most_border_; ++border) {
    const auto read = ReadCells(image, family_, border, corners, blurred, threshold_.min_range());
    if (!read) break;
    const int most = best ? best->code.wrong_bits - 1 : kMostWrongBits;
    const auto code = target::NearestTag(family_, read->bits, most);
    if (code) best = Decoded{*code, read->contrast, family_.data_cells + 2 * border};
    if (best && best->code.wrong_bits <= family_.correctable_bits) break;
  }
  return best;
}

/// Verifies and decodes one quadrilateral.
TagDetector::Attempt TagDetector::TagAt(const image::LumaView& image, double reach_px,
                                        Corners corners, const lens::Lens* lens) const {
  EdgeSearch edges;
  edges.min_step = 0.4 * threshold_.min_range();
  edges.reach_px = reach_px;
  // Where random cells often match, a hidden part of the border would let too many squares pass.
  if (family_.strict) edges.min_share = edges.min_mean_share;
  const auto sides = AlignWithEdges(image, edges, corners);
  if (!sides) return {.blurred = true};
  Attempt attempt{.blurred = sides->sharpness < kSharp};
  const bool mixed = sides->sharpness < kUnmixed;
  auto decoded = Decode(image, corners, mixed);
  if (!decoded) return attempt;
  const auto is_readable = [&] { return decoded->code.wrong_bits <= family_.correctable_bits; };
  if (!is_readable() && ShortestSide(corners) >= kFewPixels * decoded->cells) return attempt;
  auto refined = RefineCorners(image, corners, sides->hidden, decoded->cells, lens);
  const bool exact = refined && std::ranges::none_of(sides->hidden, &HiddenParts::any);
  if (!refined) {
    // Too few pixels for the fit, or too much of the cells in the blurred edge.
    const double sd_px = std::max(kAligned_px, sides->scatter_px);
    refined = RefinedCorners{corners, sd_px * sd_px * CornersCovariance::Identity()};
  } else if (!is_readable()) {
    decoded = Decode(image, refined->corners, mixed);
  }
  if (!decoded || !is_readable()) return attempt;
  const target::TagCode& code = decoded->code;
  attempt.found = FoundTag{
      Turned({code.id, code.wrong_bits, refined->corners, refined->covariance, decoded->contrast},
             code.turns),
      exact};
  return attempt;
}

void TagDetector::Search(const image::LumaView& image, const Part& part, bool whole,
                         const lens::Lens* lens, SeenTags& seen) {
  const ImageBox box = WithinImage(part.box, image.size());
  if (std::min(box.width(), box.height()) < kMinImage_px) return;
  MakeSearchImage(image, box, part.reduction, search_);
  for (SearchImage& level : coarser_) level.width = 0;
  threshold_.Apply(search_, whole);
  examined_.Clear();
  quadrilaterals_.clear();
  QuadFinder::Limits limits{.max_regions = settings_.max_regions};
  if (whole && search_.shrink == 1) {  // larger ones are found at half the resolution
    limits.min_side = kMinSmallTag_px;
    limits.max_side = kMaxSmallTag_px;
  }
  quads_.Find(search_, limits, quadrilaterals_);
  seen.limited |= quads_.limited();
  AddTags(image, part, lens);
  if (settings_.threshold) return;
  // Tags that are regions of their own are found by now; the others have edges, at least.
  for (const FoundTag& found : found_) {
    if (found.exact) IgnoreWithin(search_, found.tag.corners_px);
  }
  segments_.clear();
  quadrilaterals_.clear();
  segment_finder_.Find(search_, {.min_step = threshold_.edge_range()}, segments_);
  line_quads_.Find(search_, segments_, quadrilaterals_);
  AddTags(image, part, lens);
}

/// Adds the tags among quadrilaterals_.
void TagDetector::AddTags(const image::LumaView& image, const Part& part, const lens::Lens* lens) {
  const double reach_px = kAlike_px * search_.shrink;
  for (const Corners& corners : quadrilaterals_) {
    if (!examined_.Add(corners, reach_px)) continue;
    const bool known = std::ranges::any_of(found_, [&](const FoundTag& found) {
      return found.exact && AreAlike(corners, found.tag.corners_px, reach_px);
    });
    if (known) continue;
    const auto found = TagAtAnyLevel(image, part, corners, lens);
    if (!found) continue;
    const SeenTag& tag = found->tag;
    const auto same = std::ranges::find_if(
        found_, [&](const FoundTag& other) { return SameTag(tag, other.tag); });
    if (same == found_.end()) {
      found_.push_back(*found);
    } else if (MoreExact(tag, same->tag)) {
      *same = *found;
    }
  }
}

/// Verifies and decodes one quadrilateral at the finest resolution at which that succeeds: a large
/// tag out of focus looks like a small sharp one in a reduced image.
std::optional<TagDetector::FoundTag> TagDetector::TagAtAnyLevel(const image::LumaView& image,
                                                                const Part& part,
                                                                const Corners& corners,
                                                                const lens::Lens* lens) {
  const double cell_px = ShortestSide(corners) / family_.cells();
  // Stay within the border: the edges of the data cells are a cell further in.
  const double reach_px = std::clamp(0.8 * cell_px, 2.0, 2.0 * search_.shrink);
  Attempt attempt = TagAt(image, reach_px, corners, lens);
  std::optional<FoundTag> found = attempt.found;
  const SearchImage* level = part.reduction == Reduction::kHalf ? &search_ : nullptr;
  for (std::size_t k = 0; level != nullptr && attempt.blurred && !(found && found->exact) &&
                          cell_px >= kMinReducedCell_px * level->shrink;
       ++k) {
    const image::LumaView view{level->grey.data(), level->width, level->height, level->width};
    Corners reduced;
    for (int c = 0; c < 4; ++c) reduced[c] = level->PixelOf(corners[c]);
    const double reach = std::clamp(0.8 * cell_px / level->shrink, 2.0, 4.0);
    const auto reduced_lens = lens != nullptr ? std::optional(level->LensOf(*lens)) : std::nullopt;
    attempt = TagAt(view, reach, reduced, reduced_lens ? &*reduced_lens : nullptr);
    if (attempt.found) {
      for (auto& corner : attempt.found->tag.corners_px) {
        corner = level->ImagePixel(corner.x(), corner.y());
      }
      attempt.found->tag.covariance *= level->shrink * level->shrink;
      if (!found || MoreExact(attempt.found->tag, found->tag)) found = attempt.found;
    }
    if (k == coarser_.size()) break;
    if (coarser_[k].width == 0) MakeCoarser(*level, coarser_[k]);
    level = &coarser_[k];
  }
  return found;
}

void TagDetector::Detect(const image::LumaView& image, const lens::Lens* lens, SeenTags& seen) {
  Start(seen);
  const ImageBox whole{0, 0, image.width, image.height};
  Search(image, {whole, Reduction::kHalf}, true, lens, seen);
  if (settings_.small_tags) {
    const bool noisy = threshold_.min_range() >= kNoisyRange;
    Search(image, {whole, Reduction::kNone}, true, lens, seen);
    if (noisy) Search(image, {whole, Reduction::kSmooth}, true, lens, seen);
  }
  Finish(seen);
}

void TagDetector::DetectIn(const image::LumaView& image, const std::vector<Part>& parts,
                           const lens::Lens* lens, SeenTags& seen) {
  Start(seen);
  for (const Part& part : parts) Search(image, part, false, lens, seen);
  Finish(seen);
}

void TagDetector::Start(SeenTags& seen) {
  found_.clear();
  seen.tags.clear();
  seen.limited = false;
}

void TagDetector::Finish(SeenTags& seen) const {
  for (const FoundTag& found : found_) seen.tags.push_back(found.tag);
  std::ranges::stable_sort(seen.tags,
                           [](const SeenTag& a, const SeenTag& b) { return a.id < b.id; });
}

}  // namespace plumbline::vision
