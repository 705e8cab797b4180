#include "app/vision/tracking/decode.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace plumbline::vision {
namespace {

constexpr double kSampleOffset = 0.22;  // of a cell: position of the samples in it
constexpr double kThinMargin = 0.4;     // of a cell: position of the samples around the border
constexpr double kSmallCell_px = 3.5;   // smaller cells are sharpened, since blur mixes neighbours
constexpr double kTinyCell_px = 1.9;    // and even smaller ones twice as much
constexpr double kSharpening = 0.25, kTinySharpening = 0.5;
constexpr double kStrictMargin = 0.2;  // of the contrast: data cell to threshold, strict families
constexpr int kMaxCells = 13;          // per side, including the surrounding ring

/// Grey levels of all cells and of a ring around them.
class Cells {
 public:
  /// Samples the border and the ring around it.
  Cells(const image::LumaView& image, const Corners& corners, int cells, int border)
      : image_(image), map_(MapOfUnitSquare(corners)), cells_(cells), border_(border) {
    for (int r = -1; r <= cells; ++r) {
      for (int c = -1; c <= cells; ++c) {
        if (!IsData(r, c)) Sample(r, c);
      }
    }
  }
  void SampleData() {
    for (int r = border_; r < cells_ - border_; ++r) {
      for (int c = border_; c < cells_ - border_; ++c) Sample(r, c);
    }
  }
  bool IsData(int r, int c) const {
    return std::min(r, c) >= border_ && std::max(r, c) < cells_ - border_;
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
  double Sharpened(int r, int c, double sharpening) const {
    const double around = At(r - 1, c) + At(r + 1, c) + At(r, c - 1) + At(r, c + 1);
    return At(r, c) + sharpening * (4 * At(r, c) - around);
  }

 private:
  void Sample(int r, int c) {
    // The homography and its derivatives at the middle of the cell, outside the border close to it:
    // the margin may be thin.
    const double x = std::clamp(c + 0.5, -kThinMargin, cells_ + kThinMargin);
    const double y = std::clamp(r + 0.5, -kThinMargin, cells_ + kThinMargin);
    const Vec3 q = map_ * (Vec3(x, y, cells_) / cells_);
    const double inverse = 1 / q.z(), u = q.x() * inverse, v = q.y() * inverse;
    const double offset = kSampleOffset / cells_ * inverse;
    const double du_c = offset * (map_(0, 0) - u * map_(2, 0));
    const double dv_c = offset * (map_(1, 0) - v * map_(2, 0));
    const double du_r = offset * (map_(0, 1) - u * map_(2, 1));
    const double dv_r = offset * (map_(1, 1) - v * map_(2, 1));
    At(r, c) = 0.2 * (GreyAt(image_, u, v) + GreyAt(image_, u - du_c - du_r, v - dv_c - dv_r) +
                      GreyAt(image_, u + du_c - du_r, v + dv_c - dv_r) +
                      GreyAt(image_, u - du_c + du_r, v - dv_c + dv_r) +
                      GreyAt(image_, u + du_c + du_r, v + dv_c + dv_r));
  }

  const image::LumaView& image_;
  const Mat3 map_;
  int cells_, border_;
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

std::optional<CellReading> ReadCells(const image::LumaView& image, const target::TagFamily& family,
                                     int border_cells, const Corners& corners, bool blurred,
                                     double min_contrast) {
  const int n = family.data_cells + 2 * border_cells;
  Cells cells(image, corners, n, border_cells);
  const Vec3 dark = cells.PlaneOfRing(0), bright = cells.PlaneOfRing(-1);
  const Vec3 middle(1, 0.5 * (n - 1), 0.5 * (n - 1));
  CellReading reading;
  reading.contrast = (bright - dark).dot(middle);
  if (!(reading.contrast >= min_contrast)) return std::nullopt;

  const Vec3 threshold = 0.5 * (dark + bright);
  const double area = 0.5 * std::abs((corners[2] - corners[0]).x() * (corners[3] - corners[1]).y() -
                                     (corners[2] - corners[0]).y() * (corners[3] - corners[1]).x());
  const double cell_px = std::sqrt(area) / n;
  const double sharpening = cell_px < kTinyCell_px               ? kTinySharpening
                            : cell_px < kSmallCell_px || blurred ? kSharpening
                                                                 : 0;
  int bright_border = 0, border = 0, dark_around = 0, around = 0;
  const auto level_at = [&](int r, int c) { return threshold.dot(Vec3(1, c, r)); };
  for (int r = -1; r <= n; ++r) {
    for (int c = -1; c <= n; ++c) {
      if (cells.OnRing(r, c, -1)) {
        ++around;
        dark_around += cells.At(r, c) < level_at(r, c) ? 1 : 0;
      } else if (!cells.IsData(r, c)) {
        ++border;
        bright_border += cells.At(r, c) > level_at(r, c) ? 1 : 0;
      }
    }
  }
  if (14 * bright_border > border || 6 * dark_around > around) return std::nullopt;
  if (family.strict && (bright_border > 0 || dark_around > 0)) return std::nullopt;
  cells.SampleData();
  double margin = reading.contrast;  // smallest distance of a data cell from its threshold
  for (int r = border_cells; r < n - border_cells; ++r) {
    for (int c = border_cells; c < n - border_cells; ++c) {
      const double grey = cells.Sharpened(r, c, sharpening);
      reading.bits = (reading.bits << 1) | (grey > level_at(r, c) ? 1 : 0);
      margin = std::min(margin, std::abs(grey - level_at(r, c)));
    }
  }
  if (family.strict && margin < kStrictMargin * reading.contrast) return std::nullopt;
  return reading;
}

}  // namespace plumbline::vision
