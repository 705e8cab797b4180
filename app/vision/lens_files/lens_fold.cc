#include "app/vision/lens_files/lens_fold.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace plumbline::vision {
namespace {

constexpr double kStep_rad = 5e-4;  // of the search over the angle

/// Radius of the image of a direction before scaling by the focal length.
double RadiusAt(const lens::Lens& radial, double angle_rad) {
  if (!radial.fisheye) {
    return lens::DistortedNormalised(radial, lens::Vec2(std::tan(angle_rad), 0)).x();
  }
  const double t2 = angle_rad * angle_rad;
  return angle_rad * (1 + t2 * (radial.k1 + t2 * (radial.k2 + t2 * (radial.k3 + t2 * radial.k4))));
}

}  // namespace

std::optional<LensFold> FoldInside(const lens::Lens& lens, const image::ImageSize& size) {
  lens::Lens radial = lens;
  radial.p1 = radial.p2 = radial.s1 = radial.s2 = radial.s3 = radial.s4 = 0;
  double corner = 0;  // normalised
  for (const double u : {-0.5, size.width - 0.5}) {
    for (const double v : {-0.5, size.height - 0.5})
      corner = std::max(corner, std::hypot((u - lens.cx) / lens.fx, (v - lens.cy) / lens.fy));
  }
  const double focal_px = std::sqrt(lens.fx * lens.fy);
  const double largest_rad = (lens.fisheye ? 1 : 0.5) * std::numbers::pi - kStep_rad;
  double farthest = 0;
  for (double angle = kStep_rad; angle < largest_rad && farthest < corner; angle += kStep_rad) {
    const double here = RadiusAt(radial, angle);
    if (!(here > farthest)) {
      return LensFold{focal_px * farthest, angle - kStep_rad, focal_px * corner};
    }
    farthest = here;
  }
  return std::nullopt;
}

std::string FoldNote(const lens::Lens& lens, const image::ImageSize& size) {
  const auto fold = FoldInside(lens, size);
  if (!fold) return "";
  return fmt::format(
      "the {} distortion folds back {:.0f} px from the centre, {:.1f} deg from the axis, inside "
      "the image (its corners are up to {:.0f} px away): pixels further out have no direction, and "
      "the "
      "lens is doubtful near there. Calibrate it with a target that reaches into the corners, or "
      "with fewer terms.",
      lens.fisheye ? "fisheye" : "radial", fold->radius_px,
      fold->angle_rad * 180 / std::numbers::pi, fold->corner_px);
}

}  // namespace plumbline::vision
