#include "app/tracking/decode.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "app/tracking/luma_sampling.h"

namespace plumbline::tracking {
namespace {

constexpr double kSampleOffset = 0.22;  // of a cell: position of the samples in it
constexpr double kSmallCell_px = 3.5;   // smaller cells are sharpened, since blur mixes neighbours
constexpr double kSharpening = 0.25;
constexpr double kStrictMargin = 0.2;  // of the contrast: data cell to threshold, strict families
constexpr int kMaxCells = 11;          // per side, including the surrounding ring

/// Grey levels of all cells and of a ring around them.
class Cells {
 public:
  Cells(const image::LumaView& image, const Corners& corners, int cells) : cells_(cells) {
    const Mat3 map = MapOfUnitSquare(corners);
    const auto grey_at = [&](double x, double y) {
      const lens::Vec2 p = Mapped(map, lens::Vec2(x, y) / cells);
      return GreyAt(image, p.x(), p.y());
    };
    for (int r = -1; r <= cells; ++r) {
      for (int c = -1; c <= cells; ++c) {
        const double x = c + 0.5, y = r + 0.5;
        At(r, c) = 0.2 * (grey_at(x, y) + grey_at(x - kSampleOffset, y - kSampleOffset) +
                          grey_at(x + kSampleOffset, y - kSampleOffset) +
                          grey_at(x - kSampleOffset, y + kSampleOffset) +
                          grey_at(x + kSampleOffset, y + kSampleOffset));
      }
    }
  }
  double& At(int r, int c) { return grey_[static_cast<std::size_t>(r + 1) * kMaxCells + c + 1]; }
  double At(int r, int c) const {
    return grey_[static_cast<std::size_t>(r + 1) * kMaxCells + c + 1];
  }

  /// Whether the cell is on a ring: -1 around the tag, 0 its border.
  bool OnRing(int r, int c, int ring) const {
    const int last = cells_ - 1 - ring;
    return (r == ring || r == last || c == ring || c == last) && r >= ring && r <= last &&
           c >= ring && c <= last;
  }

  /// Least-squares plane grey = plane . (1, c, r) through the cells of a ring.
  Vec3 PlaneOfRing(int ring) const {
    Mat3 normal = Mat3::Zero();
    Vec3 right = Vec3::Zero();
    for (int r = -1; r <= cells_; ++r) {
      for (int c = -1; c <= cells_; ++c) {
        if (!OnRing(r, c, ring)) continue;
        const Vec3 at(1, c, r);
        normal += at * at.transpose();
        right += At(r, c) * at;
      }
    }
    return normal.inverse() * right;
  }

  /// Grey level of a data cell with the blur from its neighbours removed.
  double Sharpened(int r, int c) const {
    const double around = At(r - 1, c) + At(r + 1, c) + At(r, c - 1) + At(r, c + 1);
    return At(r, c) + kSharpening * (4 * At(r, c) - around);
  }

 private:
  int cells_;
  std::array<double, std::size_t{kMaxCells} * kMaxCells> grey_{};
};

}  // namespace

Mat3 MapOfUnitSquare(const Corners& p) {
  // [P. Heckbert, Fundamentals of texture mapping and image warping, 1989, section 2.2.3]
  const lens::Vec2 sum = p[0] - p[1] + p[2] - p[3];
  const lens::Vec2 d1 = p[1] - p[2], d2 = p[3] - p[2];
  const double det = d1.x() * d2.y() - d2.x() * d1.y();
  const double g = (sum.x() * d2.y() - d2.x() * sum.y()) / det;
  const double h = (d1.x() * sum.y() - sum.x() * d1.y()) / det;
  Mat3 map;
  map << p[1].x() - p[0].x() + g * p[1].x(), p[3].x() - p[0].x() + h * p[3].x(), p[0].x(),
      p[1].y() - p[0].y() + g * p[1].y(), p[3].y() - p[0].y() + h * p[3].y(), p[0].y(), g, h, 1;
  return map;
}

lens::Vec2 Mapped(const Mat3& map, const lens::Vec2& point) {
  const Vec3 q = map * Vec3(point.x(), point.y(), 1);
  return {q.x() / q.z(), q.y() / q.z()};
}

std::optional<DecodedTag> DecodeCells(const image::LumaView& image, const TagFamily& family,
                                      const Corners& corners, double min_contrast) {
  const int n = family.cells();
  const Cells cells(image, corners, n);
  const Vec3 dark = cells.PlaneOfRing(0), bright = cells.PlaneOfRing(-1);
  const Vec3 middle(1, 0.5 * (n - 1), 0.5 * (n - 1));
  const double contrast = (bright - dark).dot(middle);
  if (!(contrast >= min_contrast)) return std::nullopt;

  const Vec3 threshold = 0.5 * (dark + bright);
  const double area = 0.5 * std::abs((corners[2] - corners[0]).x() * (corners[3] - corners[1]).y() -
                                     (corners[2] - corners[0]).y() * (corners[3] - corners[1]).x());
  const bool small = std::sqrt(area) < kSmallCell_px * n;
  int bright_border = 0, border = 0, dark_around = 0, around = 0;
  std::uint64_t read = 0;
  double margin = contrast;  // smallest distance of a data cell from its threshold
  for (int r = -1; r <= n; ++r) {
    for (int c = -1; c <= n; ++c) {
      const double level = threshold.dot(Vec3(1, c, r));
      if (cells.OnRing(r, c, -1)) {
        ++around;
        dark_around += cells.At(r, c) < level ? 1 : 0;
      } else if (cells.OnRing(r, c, 0)) {
        ++border;
        bright_border += cells.At(r, c) > level ? 1 : 0;
      } else {
        const double grey = small ? cells.Sharpened(r, c) : cells.At(r, c);
        read = (read << 1) | (grey > level ? 1 : 0);
        margin = std::min(margin, std::abs(grey - level));
      }
    }
  }
  if (14 * bright_border > border || 6 * dark_around > around) return std::nullopt;
  if (family.strict &&
      (bright_border > 0 || dark_around > 0 || margin < kStrictMargin * contrast)) {
    return std::nullopt;
  }
  const auto code = NearestTag(family, read);
  if (!code) return std::nullopt;
  return DecodedTag{*code, contrast};
}

}  // namespace plumbline::tracking
