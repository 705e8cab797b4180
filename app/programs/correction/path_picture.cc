#include "app/programs/correction/path_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "firmware-like/geometry/units.h"

namespace plumbline::programs {
namespace {

constexpr double kWidth = 460, kHeight = 380, kMargin = 30;

/// One view: the axes of B that point right and up, and the scale.
struct View {
  int right = 0, up = 1;
  const char* title = "";
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  double px_per_m = 1, left_px = 0;

  Eigen::Vector2d At(const Vec3& p) const {
    const Eigen::Vector2d from_centre = Eigen::Vector2d(p[right], p[up]) - centre;
    return {left_px + kWidth / 2 + px_per_m * from_centre.x(),
            kHeight / 2 - px_per_m * from_centre.y()};
  }
};

std::string Line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const char* colour,
                 double width) {
  return fmt::format(
      "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\" "
      "stroke-width=\"{}\"/>\n",
      a.x(), a.y(), b.x(), b.y(), colour, width);
}

/// Largest number 1, 2 or 5 times a power of ten that is not above a value.
double Rounded(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  const double digit = value / power;
  return power * (digit >= 5 ? 5 : digit >= 2 ? 2 : 1);
}

}  // namespace

std::string PathPicture(const ProgramCorrection& correction) {
  constexpr std::size_t kMostPoints = 5000;
  constexpr const char *kPath = "#a9b4bb", *kBefore = "#c0392b", *kAfter = "#0b6e8f";
  std::vector<const PointCorrection*> points;
  for (const PointCorrection& point : correction.points) {
    if (point.reason.empty() && points.size() < kMostPoints) points.push_back(&point);
  }
  if (points.empty()) return "";
  Vec3 low = points.front()->target_B, high = low;
  double largest_m = 0;
  for (const PointCorrection* point : points) {
    low = low.cwiseMin(point->target_B);
    high = high.cwiseMax(point->target_B);
    largest_m = std::max(largest_m, (point->before_B - point->target_B).norm());
  }
  const double extent_m = std::max((high - low).maxCoeff(), 0.05);
  const double factor = largest_m > 1e-9 ? Rounded(std::max(0.12 * extent_m / largest_m, 1.0)) : 1;
  std::array<View, 2> views = {View{0, 1, "from above: x right, y up"},
                               View{0, 2, "from the side: x right, z up"}};
  std::string svg = fmt::format(
      "<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"path and errors\" "
      "font-family=\"sans-serif\" font-size=\"12\">\n",
      2 * kWidth, kHeight + 20);
  double left_px = 0;
  for (View& view : views) {
    const Vec3 middle = 0.5 * (low + high);
    view.centre = {middle[view.right], middle[view.up]};
    view.left_px = left_px;
    const double wide_m = std::max(high[view.right] - low[view.right], 0.02 * extent_m),
                 high_m = std::max(high[view.up] - low[view.up], 0.02 * extent_m);
    const double room_m = 0.26 * extent_m;  // for the errors
    view.px_per_m = std::min((kWidth - 2 * kMargin) / (wide_m + room_m),
                             (kHeight - 2 * kMargin) / (high_m + room_m));
    left_px += kWidth;
    svg += fmt::format("<text x=\"{:.0f}\" y=\"16\" fill=\"#25313a\">{}</text>\n",
                       view.left_px + 10, view.title);
    // Motions between corrected points.
    std::size_t lines = 0;
    for (const MotionAt& motion : correction.flow.motions) {
      if (!motion.motion->end.point) continue;
      for (const std::size_t before : motion.starts) {
        if (++lines > kMostPoints) break;
        const auto& start = correction.flow.motions[before].motion->end.point;
        const PointCorrection& end = correction.points[*motion.motion->end.point];
        if (!start || !end.reason.empty() || !correction.points[*start].reason.empty()) continue;
        svg += Line(view.At(correction.points[*start].target_B), view.At(end.target_B), kPath, 1);
      }
    }
    for (const PointCorrection* point : points) {
      const auto enlarged = [&](const Vec3& landing) {
        return view.At(point->target_B + factor * (landing - point->target_B));
      };
      const Eigen::Vector2d at = view.At(point->target_B);
      svg += Line(at, enlarged(point->before_B), kBefore, 1.5);
      const Eigen::Vector2d after = enlarged(point->after_B);
      svg += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.2\" fill=\"{}\"/>\n", after.x(),
                         after.y(), kAfter);
    }
  }
  svg += fmt::format(
      "<text x=\"10\" y=\"{:.0f}\" fill=\"#25313a\"><tspan fill=\"{}\">red: error before</tspan>, "
      "<tspan fill=\"{}\">blue: after</tspan>; errors enlarged {:.0f} times, largest {:.3f} mm; "
      "width of a view {:.0f} mm</text>\n</svg>\n",
      kHeight + 12, kBefore, kAfter, factor, kMmPerMetre * largest_m,
      kMmPerMetre * kWidth / views[0].px_per_m);
  return "<h2>Path</h2>\n" + svg;
}

}  // namespace plumbline::programs
