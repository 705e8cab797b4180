#include "app/vision/tracking/tag_detector.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "app/vision/tracking/decode.h"
#include "app/vision/tracking/quads.h"
#include "firmware-like/image/luma_view.h"
#include "firmware-like/lens/lens.h"

namespace plumbline::vision {
namespace {

// Alignment of a rough quadrilateral with the edges in the full image, to a third of a pixel.

struct EdgeSearch {
  double reach_px = 4;     ///< search range on either side of the rough side
  double min_step = 5;     ///< smallest dark-to-bright step [grey levels]
  double min_share = 0.7;  ///< share of the positions along a side that must show such a step
};

constexpr int kMaxProfiles = 24, kMinProfiles = 8;
constexpr double kEndMargin = 0.1;  // share of a side that is skipped at each end
constexpr int kTrimRounds = 3;      // rounds of outlier removal
constexpr double kMinTrim_px = 0.8;
constexpr int kMaxReach = 8;

/// A straight line n . p = offset, n pointing outwards.
struct Line {
  lens::Vec2 normal;
  double offset;
};

/// Edge position of one profile.
struct Place {
  double along, across;  ///< [px] from the middle of the side; outwards positive
  bool used;
};

/// Position of the steepest outward rise, and its height over three pixels.
struct Step {
  double across, height;
};

Step SteepestRise(const image::LumaView& image, const lens::Vec2& at, const lens::Vec2& normal,
                  int reach) {
  std::array<double, 2 * kMaxReach + 4> grey{};
  const int half = reach + 1;
  for (int k = -half; k <= half + 1; ++k) {
    const lens::Vec2 p = at + (k - 0.5) * normal;
    grey[k + half] = GreyAt(image, p.x(), p.y());
  }
  // rise(k) is centred at offset k: two pixels outside minus two inside.
  const auto rise = [&](int k) {
    const int i = k + half;
    return 0.5 *
           (grey[i + 1] + grey[std::min(i + 2, 2 * half + 1)] - grey[i] - grey[std::max(i - 1, 0)]);
  };
  int best = -reach;
  for (int k = -reach + 1; k <= reach; ++k) {
    if (rise(k) > rise(best)) best = k;
  }
  const double before = rise(best - 1), here = rise(best), after = rise(best + 1);
  const double bend = before - 2 * here + after;
  const double shift = bend < 0 ? std::clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0.0;
  return {best + shift, here};
}

/// Least squares across = a + b along over the used points.
std::optional<std::pair<double, double>> Fit(const std::array<Place, kMaxProfiles>& places,
                                             int count) {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (int i = 0; i < count; ++i) {
    if (!places[i].used) continue;
    n += 1, x += places[i].along, y += places[i].across;
    xx += places[i].along * places[i].along, xy += places[i].along * places[i].across;
  }
  const double det = n * xx - x * x;
  if (n < 3 || !(det > 1e-9)) return std::nullopt;
  const double b = (n * xy - x * y) / det;
  return std::pair{(y - b * x) / n, b};
}

std::optional<Line> FitLineNear(const image::LumaView& image, const EdgeSearch& search,
                                const lens::Vec2& from, const lens::Vec2& to) {
  const lens::Vec2 direction = (to - from).normalized();
  const lens::Vec2 normal(direction.y(), -direction.x());
  const double length = (to - from).norm();
  const lens::Vec2 middle = 0.5 * (from + to);
  const int count = std::clamp(static_cast<int>(0.5 * length), kMinProfiles, kMaxProfiles);
  const int reach = std::clamp(static_cast<int>(search.reach_px), 1, kMaxReach);
  std::array<Place, kMaxProfiles> places{};
  int used = 0;
  for (int i = 0; i < count; ++i) {
    const double share = kEndMargin + (1 - 2 * kEndMargin) * (i + 0.5) / count - 0.5;
    const double along = share * length;
    const Step step = SteepestRise(image, middle + along * direction, normal, reach);
    places[i] = {along, step.across, step.height >= search.min_step};
    used += places[i].used ? 1 : 0;
  }
  if (used < search.min_share * count) return std::nullopt;
  auto fit = Fit(places, count);
  for (int trim = 0; fit && trim < kTrimRounds; ++trim) {
    std::array<double, kMaxProfiles> off{};
    int n = 0;
    for (int i = 0; i < count; ++i) {
      const double miss = std::abs(places[i].across - fit->first - fit->second * places[i].along);
      if (places[i].used) off[n++] = miss;
    }
    if (n < 3) return std::nullopt;
    std::nth_element(off.begin(), off.begin() + n / 2, off.begin() + n);
    const double most = std::max(kMinTrim_px, 2.5 * off[n / 2]);
    for (int i = 0; i < count; ++i) {
      const double miss = std::abs(places[i].across - fit->first - fit->second * places[i].along);
      places[i].used &= miss <= most;
    }
    fit = Fit(places, count);
  }
  const auto kept = std::count_if(places.begin(), places.begin() + count,
                                  [](const Place& place) { return place.used; });
  if (!fit || static_cast<double>(kept) < search.min_share * count) return std::nullopt;
  const lens::Vec2 turned = (normal - fit->second * direction).normalized();
  return Line{turned, turned.dot(middle + fit->first * normal)};
}

/// Moves the sides onto the steps from dark inside to bright outside: finds the steepest point of
/// up to 24 profiles across each side, fits a straight line to these points without outliers, and
/// intersects the four lines.
/// @return  true if all four sides follow an edge; otherwise the quadrilateral is not a tag
bool SnapToEdges(const image::LumaView& image, const EdgeSearch& search, Corners& corners) {
  std::array<Line, 4> lines;
  for (int k = 0; k < 4; ++k) {
    const auto line = FitLineNear(image, search, corners[k], corners[(k + 1) % 4]);
    if (!line) return false;
    lines[k] = *line;
  }
  Corners snapped;
  for (int k = 0; k < 4; ++k) {
    const Line &before = lines[(k + 3) % 4], &after = lines[k];
    Eigen::Matrix2d N;
    N << before.normal.transpose(), after.normal.transpose();
    if (std::abs(N.determinant()) < 0.15) return false;
    snapped[k] = N.inverse() * lens::Vec2(before.offset, after.offset);
    if ((snapped[k] - corners[k]).norm() > 3 * search.reach_px) return false;
  }
  corners = snapped;
  return true;
}

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
std::optional<SeenTag> TagDetector::TagAt(const image::LumaView& image, double reach_px,
                                          Corners corners, const lens::Lens* lens) const {
  EdgeSearch edges;
  edges.min_step = 0.4 * threshold_.min_range();
  edges.reach_px = reach_px;
  if (!SnapToEdges(image, edges, corners)) return std::nullopt;
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
  auto refined = RefineCorners(image, corners, cells, lens);
  if (!refined) {
    if (!decoded || !is_small(cells)) return std::nullopt;
    // A small tag may have too few pixels for the fit.
    refined = RefinedCorners{corners, kSnapped_px * kSnapped_px * CornersCovariance::Identity()};
  }
  if (!decoded) decoded = Decode(image, refined->corners, family_.correctable_bits);
  if (!decoded) return std::nullopt;
  const target::TagCode& code = decoded->code;
  return Turned(
      {code.id, code.wrong_bits, refined->corners, refined->covariance, decoded->contrast},
      code.turns);
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
  segments_.clear();
  segment_finder_.Find(search_, {.min_step = threshold_.min_range()}, segments_);
  line_quads_.Find(search_, segments_, found_);
  for (const Corners& corners : found_) {
    // Stay within the border: the edges of the data cells are a cell further in.
    const double reach_px =
        std::clamp(0.8 * ShortestSide(corners) / family_.cells(), 2.0, 2.0 * search_.shrink);
    const auto tag = TagAt(image, reach_px, corners, lens);
    if (!tag) continue;
    const auto same =
        std::ranges::find_if(seen.tags, [&](const SeenTag& other) { return SameTag(*tag, other); });
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
