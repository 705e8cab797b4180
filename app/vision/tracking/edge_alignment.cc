#include "app/vision/tracking/edge_alignment.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "app/vision/tracking/decode.h"

namespace plumbline::vision {
namespace {

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

/// Position of the steepest outward rise, its height over three pixels, and the rise of all.
struct Step {
  double across, height, whole;
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
  const auto [darkest, brightest] = std::minmax_element(grey.begin(), grey.begin() + 2 * half + 2);
  return {best + shift, here, *brightest - *darkest};
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

/// Marks two and more positions in a row that do not lie on the edge.
HiddenParts HiddenPartsOf(const std::array<Place, kMaxProfiles>& places, int count) {
  HiddenParts hidden;
  for (int i = 0; i < count; ++i) {
    int end = i;
    while (end < count && !places[end].used) ++end;
    if (end - i < 2) continue;
    const auto share = [&](int k) { return kEndMargin + (1 - 2 * kEndMargin) * k / count; };
    hidden.Hide(i == 0 ? 0 : share(i), end == count ? 1 : share(end));
    i = end;
  }
  return hidden;
}

/// A side's line and the share of its positions that lie on it.
struct FittedSide {
  Line line;
  double share;
  double sharpness;
  double scatter_px;  ///< mean distance of these positions from it
  HiddenParts hidden;
};

std::optional<FittedSide> FitLineNear(const image::LumaView& image, const EdgeSearch& search,
                                      const lens::Vec2& from, const lens::Vec2& to) {
  const lens::Vec2 direction = (to - from).normalized();
  const lens::Vec2 normal(direction.y(), -direction.x());
  const double length = (to - from).norm();
  const lens::Vec2 middle = 0.5 * (from + to);
  const int count = std::clamp(static_cast<int>(0.5 * length), kMinProfiles, kMaxProfiles);
  const int reach = std::clamp(static_cast<int>(search.reach_px), 1, kMaxReach);
  std::array<Place, kMaxProfiles> places{};
  int used = 0;
  double steps = 0, rises = 0;
  for (int i = 0; i < count; ++i) {
    const double share = kEndMargin + (1 - 2 * kEndMargin) * (i + 0.5) / count - 0.5;
    const double along = share * length;
    const Step step = SteepestRise(image, middle + along * direction, normal, reach);
    places[i] = {along, step.across, step.height >= search.min_step};
    if (!places[i].used) continue;
    ++used;
    steps += step.height;
    rises += step.whole;
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
  int kept = 0;
  double misses = 0;
  for (int i = 0; fit && i < count; ++i) {
    if (!places[i].used) continue;
    ++kept;
    misses += std::abs(places[i].across - fit->first - fit->second * places[i].along);
  }
  if (kept == 0 || kept < search.min_share * count) return std::nullopt;
  const lens::Vec2 turned = (normal - fit->second * direction).normalized();
  return FittedSide{{turned, turned.dot(middle + fit->first * normal)},
                    static_cast<double>(kept) / count,
                    steps / rises,
                    misses / kept,
                    HiddenPartsOf(places, count)};
}

}  // namespace

int HiddenParts::PartOf(double s) {
  return std::clamp(static_cast<int>(s * kParts), 0, kParts - 1);
}

void HiddenParts::Hide(double from, double to) {
  for (int part = PartOf(from); part <= PartOf(to); ++part) bits_ |= std::uint32_t{1} << part;
}

std::optional<AlignedSides> AlignWithEdges(const image::LumaView& image, const EdgeSearch& search,
                                           Corners& corners) {
  std::array<Line, 4> lines;
  AlignedSides sides;
  double shares = 0;
  for (int k = 0; k < 4; ++k) {
    const auto side = FitLineNear(image, search, corners[k], corners[(k + 1) % 4]);
    if (!side) return std::nullopt;
    lines[k] = side->line;
    sides.hidden[k] = side->hidden;
    sides.sharpness += 0.25 * side->sharpness;
    sides.scatter_px += 0.25 * side->scatter_px;
    shares += side->share;
    if (shares + (3 - k) < 4 * search.min_mean_share) return std::nullopt;
  }
  Corners snapped;
  for (int k = 0; k < 4; ++k) {
    const Line &before = lines[(k + 3) % 4], &after = lines[k];
    Eigen::Matrix2d N;
    N << before.normal.transpose(), after.normal.transpose();
    if (std::abs(N.determinant()) < 0.15) return std::nullopt;
    snapped[k] = N.inverse() * lens::Vec2(before.offset, after.offset);
    if ((snapped[k] - corners[k]).norm() > 3 * search.reach_px) return std::nullopt;
  }
  corners = snapped;
  return sides;
}

}  // namespace plumbline::vision
