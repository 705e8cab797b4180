#include "app/vision/lens/disc_offsets.h"

#include <cmath>
#include <numbers>

namespace plumbline::vision {
namespace {

constexpr int kRimPoints = 24;

}  // namespace

std::vector<lens::Vec2> DiscOffsets(const target::Board& board, const SharedVector& shared,
                                    const Pose& X_CK) {
  std::vector<lens::Vec2> offsets(static_cast<std::size_t>(board.corners()), lens::Vec2::Zero());
  if (!board.circles()) return offsets;
  const lens::Lens lens = LensFromShared(shared);
  const double step = 2 * std::numbers::pi / kRimPoints;
  // A regular polygon of circumradius R has the moment R^2 (2 + cos(step)) / 6 where a disc of
  // radius r has r^2 / 2.
  const double radius = 0.5 * board.marker_m * std::sqrt(3 / (2 + std::cos(step)));
  const lens::Vec2 middle = board.Centre();
  const auto pixel = [&](const lens::Vec2& xy) -> std::optional<lens::Vec2> {
    const lens::Vec2 c = xy - middle;
    const double z = shared[kBowX] * c.x() * c.x() + shared[kBowY] * c.y() * c.y() +
                     shared[kBowXY] * c.x() * c.y();
    const Vec3 p_C = X_CK.R * Vec3(xy.x(), xy.y(), z) + X_CK.p;
    if (!(p_C.z() > 0)) return std::nullopt;
    return lens::PixelOfNormalised(lens, lens::Vec2(p_C.x() / p_C.z(), p_C.y() / p_C.z()));
  };
  for (int k = 0; k < board.corners(); ++k) {
    const auto centre = pixel(board.Corner(k));
    if (!centre) continue;
    lens::Vec2 rim[kRimPoints];
    bool in_front = true;
    for (int i = 0; i < kRimPoints && in_front; ++i) {
      const auto at =
          pixel(board.Corner(k) + radius * lens::Vec2(std::cos(i * step), std::sin(i * step)));
      in_front = at.has_value();
      if (at) rim[i] = *at - *centre;
    }
    if (!in_front) continue;
    lens::Vec2 sum = lens::Vec2::Zero();
    double area = 0;
    for (int i = 0; i < kRimPoints; ++i) {
      const lens::Vec2 &a = rim[i], &b = rim[(i + 1) % kRimPoints];
      const double cross = a.x() * b.y() - a.y() * b.x();
      sum += cross * (a + b);
      area += cross;
    }
    if (area != 0) offsets[k] = sum / (3 * area);
  }
  return offsets;
}

}  // namespace plumbline::vision
