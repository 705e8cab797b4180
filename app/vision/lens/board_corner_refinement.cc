#include "app/vision/lens/board_corner_refinement.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>

#include "app/vision/lens/board_shading.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::vision {
namespace {

constexpr double kSmooth_px = 2, kSmoothAmongTags_px = 1;
constexpr double kEdgeReach_sd = 2.5;  // extent of a blurred edge, in standard deviations
constexpr double kTypicalBlur_px = 1;  // blur of an edge in a good image
constexpr double kWindow = 0.42;       // half width of a window, share of a step
constexpr int kMaxReach_px = 30;       // largest extent of a window from its corner
constexpr double kMinArea_px = 60;
constexpr float kWeightScale_px = 8;  // scale of the weight: see RefineCorners
constexpr double kMinArm_px = 2.5;    // smallest half width of a cross's arm
constexpr int kMaxRefinements = 8;
constexpr double kConverged_px = 0.1;  // the edge fit refines further
constexpr double kArm_px = 5.5;        // largest half width of a cross's arm
constexpr int kEdgePasses = 8;
constexpr double kMaxContraction = 0.9;  // largest contraction rate that is extrapolated
constexpr double kEdgesConverged_px = 0.003;
constexpr double kEdgesMaxMotion_px = 1.5;
constexpr int kMargin_px = 4;

/// A parallelogram of pixels, as an interval of columns for each row.
class Window {
 public:
  Window() = default;
  /// q = a x + b y with |a|, |b| <= 1.
  Window(const lens::Vec2& x, const lens::Vec2& y) {
    const double area = x.x() * y.y() - x.y() * y.x();
    area_px_ = 4 * std::abs(area);
    if (!(area_px_ > 0)) return;
    reach_ = static_cast<int>(std::abs(x.y()) + std::abs(y.y()));
    across_ = static_cast<int>(std::abs(x.x()) + std::abs(y.x())) + 1;
    for (int j = -reach_; j <= reach_; ++j) {
      // |u y.y - v y.x| <= |area| and |x.x v - x.y u| <= |area| for (u, v = j).
      double low = -across_, high = across_;
      const auto clip = [&](double slope, double offset) {
        if (std::abs(slope) < 1e-9) {
          if (std::abs(offset) > std::abs(area)) high = low - 1;
          return;
        }
        const double a = (-std::abs(area) - offset) / slope, b = (std::abs(area) - offset) / slope;
        low = std::max(low, std::min(a, b));
        high = std::min(high, std::max(a, b));
      };
      clip(y.y(), -j * y.x());
      clip(-x.y(), j * x.x());
      columns_.emplace_back(static_cast<int>(std::ceil(low)), static_cast<int>(std::floor(high)));
    }
  }

  double area_px() const { return area_px_; }
  int reach() const { return reach_; }
  int across() const { return across_; }
  std::pair<int, int> Columns(int row) const { return columns_[row + reach_]; }

 private:
  double area_px_ = 0;
  int reach_ = -1, across_ = 0;
  std::vector<std::pair<int, int>> columns_;
};

/// Sums over pixels q of w g g^T and w g g^T q, q measured from the window's centre.
struct Sums {
  double xx = 0, xy = 0, yy = 0, bx = 0, by = 0;

  void Add(const Sums& other, double sign) {
    xx += sign * other.xx;
    xy += sign * other.xy;
    yy += sign * other.yy;
    bx += sign * other.bx;
    by += sign * other.by;
  }
};

/// Pixels evaluated at one corner: a parallelogram, or a cross of two that share their middle.
class Region {
 public:
  Region(const LatticeSteps& steps, double rim, double smooth_px) : steps_(steps) {
    lens::Vec2 x = kWindow * steps.along_row, y = kWindow * steps.down_column;
    const double far = std::max((x + y).cwiseAbs().maxCoeff(), (x - y).cwiseAbs().maxCoeff());
    if (far > kMaxReach_px) {
      x *= kMaxReach_px / far;
      y *= kMaxReach_px / far;
    }
    // Half width of each arm: the extent of the blurred edge, limited by the tags' free margin.
    const double area = std::abs(steps.along_row.x() * steps.down_column.y() -
                                 steps.along_row.y() * steps.down_column.x());
    const auto thin = [&](const lens::Vec2& across, const lens::Vec2& along) -> lens::Vec2 {
      const double step_px = std::max(area / std::max(along.norm(), 1e-9), 1e-9);
      const double half_px = std::max(
          std::min(kArm_px, rim * step_px - kEdgeReach_sd * std::hypot(smooth_px, kTypicalBlur_px)),
          kMinArm_px);
      return across * std::min(kWindow, half_px / step_px);
    };
    const lens::Vec2 thin_x = thin(steps.along_row, steps.down_column);
    const lens::Vec2 thin_y = thin(steps.down_column, steps.along_row);
    row_arm_ = Window(x, thin_y);
    column_arm_ = Window(thin_x, y);
    if (rim >= kWindow) {
      parts_.push_back({Window(x, y), 1});
    } else {
      parts_ = {{row_arm_, 1}, {column_arm_, 1}, {Window(thin_x, thin_y), -1}};
    }
  }

  /// Whether there are enough pixels to locate a corner.
  bool enough() const { return parts_.front().window.area_px() >= kMinArea_px; }
  const LatticeSteps& steps() const { return steps_; }
  const Window& row_arm() const { return row_arm_; }
  const Window& column_arm() const { return column_arm_; }
  int reach() const { return Largest(&Window::reach); }
  int across() const { return Largest(&Window::across); }
  Sums Over(const cv::Mat& smooth, const lens::Vec2& at, int u0, int v0) const {
    Sums sums;
    for (const Part& part : parts_) sums.Add(SumsOver(part.window, smooth, at, u0, v0), part.sign);
    return sums;
  }

 private:
  struct Part {
    Window window;
    double sign;
  };
  static Sums SumsOver(const Window& window, const cv::Mat& smooth, const lens::Vec2& at, int u0,
                       int v0);
  int Largest(int (Window::*extent)() const) const {
    int largest = 0;
    for (const Part& part : parts_) largest = std::max(largest, (part.window.*extent)());
    return largest;
  }
  LatticeSteps steps_;
  Window row_arm_, column_arm_;
  std::vector<Part> parts_;
};

Sums Region::SumsOver(const Window& window, const cv::Mat& smooth, const lens::Vec2& at, int u0,
                      int v0) {
  Sums sums;
  for (int j = -window.reach(); j <= window.reach(); ++j) {
    const float* above = smooth.ptr<float>(v0 + j - 1) + u0;
    const float* here = smooth.ptr<float>(v0 + j) + u0;
    const float* below = smooth.ptr<float>(v0 + j + 1) + u0;
    const auto [first, last] = window.Columns(j);
    const float cx = static_cast<float>(at.x() - u0);
    const float dy = static_cast<float>(at.y() - v0) - static_cast<float>(j);
    const float dy2 = dy * dy + kWeightScale_px * kWeightScale_px;
    float rxx = 0, rxy = 0, ryy = 0, rxxi = 0, rxyi = 0;
    for (int i = first; i <= last; ++i) {
      const float gx = here[i + 1] - here[i - 1];
      const float gy = below[i] - above[i];
      const float x = static_cast<float>(i);
      const float dx = x - cx;
      const float w = 1 / (dx * dx + dy2);
      rxx += w * gx * gx;
      rxy += w * gx * gy;
      ryy += w * gy * gy;
      rxxi += w * gx * gx * x;
      rxyi += w * gx * gy * x;
    }
    sums.xx += rxx;
    sums.xy += rxy;
    sums.yy += ryy;
    sums.bx += rxxi + static_cast<double>(rxy) * j;
    sums.by += rxyi + static_cast<double>(ryy) * j;
  }
  return sums;
}

/// Gradient-based position of one corner; nullopt if the region leaves the image or shows no
/// corner.
std::optional<lens::Vec2> RefineByGradients(const cv::Mat& smooth, const lens::Vec2& start,
                                            const Region& region) {
  const int across = region.across(), reach = region.reach();
  lens::Vec2 at = start;
  for (int step = 0; step < kMaxRefinements; ++step) {
    const int u0 = static_cast<int>(std::lround(at.x())),
              v0 = static_cast<int>(std::lround(at.y()));
    if (u0 <= across || v0 <= reach || u0 + across + 1 >= smooth.cols ||
        v0 + reach + 1 >= smooth.rows)
      return std::nullopt;
    const Sums sums = region.Over(smooth, at, u0, v0);
    const double det = sums.xx * sums.yy - sums.xy * sums.xy;
    if (!(det > 1e-6 * (sums.xx + sums.yy) * (sums.xx + sums.yy))) return std::nullopt;
    const lens::Vec2 next(u0 + (sums.yy * sums.bx - sums.xy * sums.by) / det,
                          v0 + (sums.xx * sums.by - sums.xy * sums.bx) / det);
    if ((next - start).norm() > 0.5 * across) return std::nullopt;
    const double moved = (next - at).norm();
    at = next;
    if (moved < kConverged_px) break;
  }
  return at;
}

/// One of the two edges through a corner, as a line s = offset + slope a, with a along the unit
/// vector `along` and s to its left, both relative to the expected corner [px].
struct Edge {
  lens::Vec2 along, across;
  double offset = 0, slope = 0;
};

/// Fits a line by weighted least squares over the pixels near the edge. The weight is the squared
/// gradient across the edge minus that along it, which suppresses the other edge if the two are not
/// perpendicular. Nullopt if there is no edge.
std::optional<Edge> FitEdge(const cv::Mat& smooth, const lens::Vec2& at, const Window& arm,
                            const lens::Vec2& direction) {
  const int u0 = static_cast<int>(std::lround(at.x())), v0 = static_cast<int>(std::lround(at.y()));
  if (u0 <= arm.across() || v0 <= arm.reach() || u0 + arm.across() + 1 >= smooth.cols ||
      v0 + arm.reach() + 1 >= smooth.rows)
    return std::nullopt;
  Edge edge{direction.normalized(), {}};
  edge.across = {-edge.along.y(), edge.along.x()};
  const float nx = static_cast<float>(edge.across.x()), ny = static_cast<float>(edge.across.y());
  const float dx = static_cast<float>(at.x() - u0), dy = static_cast<float>(at.y() - v0);
  double w = 0, wa = 0, waa = 0, ws = 0, was = 0;
  for (int j = -arm.reach(); j <= arm.reach(); ++j) {
    const float* above = smooth.ptr<float>(v0 + j - 1) + u0;
    const float* here = smooth.ptr<float>(v0 + j) + u0;
    const float* below = smooth.ptr<float>(v0 + j + 1) + u0;
    const auto [first, last] = arm.Columns(j);
    const float y = static_cast<float>(j) - dy;
    float rw = 0, rwa = 0, rwaa = 0, rws = 0, rwas = 0;
    for (int i = first; i <= last; ++i) {
      const float x = static_cast<float>(i) - dx;
      const float gx = here[i + 1] - here[i - 1], gy = below[i] - above[i];
      const float g = nx * gx + ny * gy, aside = ny * gx - nx * gy;
      const float a = ny * x - nx * y;
      const float s = nx * x + ny * y;
      const float g2 = std::max(0.0F, g * g - aside * aside);
      rw += g2;
      rwa += g2 * a;
      rwaa += g2 * a * a;
      rws += g2 * s;
      rwas += g2 * a * s;
    }
    w += rw;
    wa += rwa;
    waa += rwaa;
    ws += rws;
    was += rwas;
  }
  const double det = w * waa - wa * wa;
  if (!(det > 1e-6 * waa * w)) return std::nullopt;
  edge.offset = (waa * ws - wa * was) / det;
  edge.slope = (w * was - wa * ws) / det;
  return edge;
}

/// Offset from a position to the intersection of the two edges.
std::optional<lens::Vec2> OffsetToIntersection(const cv::Mat& smooth, const lens::Vec2& at,
                                               const Region& region) {
  const auto row = FitEdge(smooth, at, region.row_arm(), region.steps().along_row);
  const auto column = FitEdge(smooth, at, region.column_arm(), region.steps().down_column);
  if (!row || !column) return std::nullopt;
  // across . q - slope along . q = offset, for both.
  Eigen::Matrix2d lines;
  lines.row(0) = row->across - row->slope * row->along;
  lines.row(1) = column->across - column->slope * column->along;
  return lens::Vec2(lines.inverse() * lens::Vec2(row->offset, column->offset));
}

/// Intersection of the two edges, iterated from a nearby start. With arms narrower than the blurred
/// edge the iteration converges linearly, so every other step is extrapolated [A. C. Aitken, 1926].
std::optional<lens::Vec2> IntersectEdges(const cv::Mat& smooth, const lens::Vec2& start,
                                         const Region& region) {
  lens::Vec2 at = start, before = lens::Vec2::Zero();
  for (int pass = 0; pass < kEdgePasses; ++pass) {
    const auto to = OffsetToIntersection(smooth, at, region);
    if (!to || !to->allFinite()) return std::nullopt;
    const double left = pass % 2 == 1 ? to->dot(before) / before.squaredNorm() : 0;
    const lens::Vec2 move = *to / (1 - std::clamp(left, 0.0, kMaxContraction));
    at += move;
    if (!((at - start).norm() < kEdgesMaxMotion_px)) return std::nullopt;
    if (to->norm() < kEdgesConverged_px) break;
    before = *to;
  }
  return at;
}

/// Gaussian width s of the unsmoothed edge [px], from its steepest slope h / (s sqrt(2 pi)) for
/// height h.
double EdgeWidth(const cv::Mat& smooth, double smooth_px, const lens::Vec2& at,
                 const Region& region) {
  const int reach = std::min(region.reach(), region.across());
  const int u0 = static_cast<int>(std::lround(at.x())), v0 = static_cast<int>(std::lround(at.y()));
  if (u0 < reach + 1 || v0 < reach + 1 || u0 + reach + 1 >= smooth.cols ||
      v0 + reach + 1 >= smooth.rows)
    return 0;
  float darkest = 1e9F, brightest = -1e9F, steepest = 0;
  for (int j = -reach; j <= reach; ++j) {
    for (int i = -reach; i <= reach; ++i) {
      const float grey = smooth.at<float>(v0 + j, u0 + i);
      darkest = std::min(darkest, grey);
      brightest = std::max(brightest, grey);
      const float gx = smooth.at<float>(v0 + j, u0 + i + 1) - smooth.at<float>(v0 + j, u0 + i - 1);
      const float gy = smooth.at<float>(v0 + j + 1, u0 + i) - smooth.at<float>(v0 + j - 1, u0 + i);
      steepest = std::max(steepest, 0.5F * std::hypot(gx, gy));
    }
  }
  const double width = (brightest - darkest) / std::max(steepest * 2.5066, 1e-6);
  return std::sqrt(std::max(0.0, width * width - smooth_px * smooth_px));
}

}  // namespace

void RefineCorners(const image::LumaView& image, const std::vector<LatticeSteps>& steps,
                   BoardView& view, double rim) {
  // Smooth only the part of the image that shows the board.
  lens::Vec2 least = lens::Vec2::Constant(1e9), most = lens::Vec2::Constant(-1e9);
  for (std::size_t k = 0; k < view.corners_px.size(); ++k) {
    if (!view.seen[k]) continue;
    least = least.cwiseMin(view.corners_px[k]);
    most = most.cwiseMax(view.corners_px[k]);
  }
  const auto inside = [](double at, int size) { return std::clamp(static_cast<int>(at), 0, size); };
  const int margin = kMaxReach_px + kMargin_px;
  const int u0 = inside(least.x() - margin, image.width);
  const int v0 = inside(least.y() - margin, image.height);
  const int u1 = inside(most.x() + margin, image.width);
  const int v1 = inside(most.y() + margin, image.height);
  if (u1 <= u0 || v1 <= v0) return;
  const cv::Mat whole(image.height, image.width, CV_8U, const_cast<std::uint8_t*>(image.data),
                      static_cast<std::size_t>(image.stride));
  cv::Mat part, smooth;
  whole(cv::Rect(u0, v0, u1 - u0, v1 - v0)).convertTo(part, CV_32F);
  const lens::Vec2 origin(u0, v0);
  if (const BoardShading shading(whole, steps, view, rim); shading.significant())
    shading.Flatten(part, origin);
  const double smooth_px = rim < kWindow ? kSmoothAmongTags_px : kSmooth_px;
  const int taps = 6 * static_cast<int>(smooth_px) + 1;  // three standard deviations each way
  cv::GaussianBlur(part, smooth, {taps, taps}, smooth_px, smooth_px, cv::BORDER_REPLICATE);
  std::vector<double> widths;
  for (std::size_t k = 0; k < view.corners_px.size(); ++k) {
    if (!view.seen[k]) continue;
    const lens::Vec2 start = view.corners_px[k] - origin;
    const Region region(steps[k], rim, smooth_px);
    std::optional<lens::Vec2> refined =
        region.enough() ? RefineByGradients(smooth, start, region) : std::nullopt;
    if (refined) refined = IntersectEdges(smooth, *refined, region);
    view.seen[k] = refined.has_value();
    if (!refined) continue;
    view.corners_px[k] = *refined + origin;
    if (k % 8 == 0) widths.push_back(EdgeWidth(smooth, smooth_px, *refined, region));
  }
  if (!widths.empty()) view.blur_px = statistics::MedianOf(widths);
}

}  // namespace plumbline::vision
