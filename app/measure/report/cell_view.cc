#include "app/measure/report/cell_view.h"

#include <algorithm>
#include <numbers>
#include <random>

#include "app/measure/report/plot.h"
#include "firmware-like/kinematics/chain.h"

namespace plumbline::measure {
namespace {

constexpr int kViewWidth = 460, kViewHeight = 420;
constexpr double kMargin = 1.1;
constexpr int kSamples = 5000;
constexpr double kWholeReach = 1.5;  // the whole outline is shown if the scale shrinks by no more

/// Tip positions of the unloaded arm throughout its joint limits, identical at every call [mm].
std::vector<Vec3> ReachedTips_mm(const model::CellModel& cell) {
  std::mt19937 random(1);
  const kinematics::Chain chain(cell.robot);
  std::vector<Vec3> tips;
  tips.reserve(kSamples);
  model::JointVector q(cell.robot.size());
  kinematics::Posture posture;
  for (int k = 0; k < kSamples; ++k) {
    for (int i = 0; i < q.size(); ++i) {
      const double low = std::max(chain.lower()[i], -std::numbers::pi);
      const double high = std::min(chain.upper()[i], std::numbers::pi);
      // Oversample the ends of the range, which determine the outline.
      const double share = std::uniform_real_distribution(-0.1, 1.1)(random);
      q[i] = low + std::clamp(share, 0.0, 1.0) * std::max(0.0, high - low);
    }
    chain.Evaluate(q, posture);
    tips.emplace_back(1e3 * (cell.robot.X_WB * (posture.X_BF() * cell.tool.tcp_F)));
  }
  return tips;
}

/// The convex hull of points in a plane, closed (Andrew's monotone chain).
std::vector<std::vector<double>> Outline(const std::vector<Vec3>& points,
                                         const Projection& projection) {
  std::vector<std::vector<double>> sorted;
  sorted.reserve(points.size());
  for (const Vec3& p : points) sorted.push_back({p[projection.right], p[projection.up]});
  std::sort(sorted.begin(), sorted.end());
  const auto turns_left = [](const auto& a, const auto& b, const auto& c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0;
  };
  std::vector<std::vector<double>> hull;
  for (int half = 0; half < 2; ++half) {
    const std::size_t first = hull.size();
    for (const auto& point : sorted) {
      while (hull.size() > first + 1 &&
             !turns_left(hull[hull.size() - 2], hull[hull.size() - 1], point)) {
        hull.pop_back();
      }
      hull.push_back(point);
    }
    std::reverse(sorted.begin(), sorted.end());
  }
  return hull;
}

}  // namespace

CellView::CellView(const model::CellModel& cell, const std::vector<Vec3>& points_W)
    : base_mm_(1e3 * cell.robot.X_WB.p), reached_mm_(ReachedTips_mm(cell)) {
  Vec3 low = base_mm_, high = base_mm_;
  for (const Vec3& p : points_W) {
    low = low.cwiseMin(1e3 * p);
    high = high.cwiseMax(1e3 * p);
  }
  const double points_only_mm = std::max(100.0, kMargin * (high - low).maxCoeff() / 2);
  centre_mm_ = (low + high) / 2;
  half_mm_ = points_only_mm;
  for (const Vec3& p : reached_mm_) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const double whole_mm = kMargin * (high - low).maxCoeff() / 2;
  if (whole_mm > kWholeReach * points_only_mm) return;
  centre_mm_ = (low + high) / 2;
  half_mm_ = whole_mm;
}

std::string CellView::Begin(const Projection& projection) const {
  std::string script = plot::Begin(kViewWidth, kViewHeight);
  script +=
      fmt::format("set size ratio -1\nset xrange [{:.6g}:{:.6g}]\nset yrange [{:.6g}:{:.6g}]\n",
                  centre_mm_[projection.right] - half_mm_, centre_mm_[projection.right] + half_mm_,
                  centre_mm_[projection.up] - half_mm_, centre_mm_[projection.up] + half_mm_);
  const double tic = plot::RoundDown(half_mm_ / 1.5);
  script += fmt::format("set xtics {:.6g}\nset ytics {:.6g}\n", tic, tic);
  script += fmt::format("set xlabel '{} (mm)'\nset ylabel '{} (mm)'\n",
                        plot::kAxisNames[projection.right], plot::kAxisNames[projection.up]);
  const double x = base_mm_[projection.right], y = base_mm_[projection.up];
  script += fmt::format(
      "set label 1 '' at {:.6g},{:.6g} point pointtype 7 pointsize 0.6 linecolor rgb '{}'\n"
      "set label 2 'base' at {:.6g},{:.6g} offset 0.7,-0.7 font ',10' textcolor rgb '{}'\n",
      x, y, plot::kInk, x, y, plot::kInk);
  script += plot::Data("outline", Outline(reached_mm_, projection));
  return script;
}

}  // namespace plumbline::measure
