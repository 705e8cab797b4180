// Figures drawn in the cell.
#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "app/measure/report/figures.h"
#include "app/measure/report/plot.h"
#include "firmware-like/kinematics/chain.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::measure {
namespace {

// Plan and side view of the cell: a panel scaled to a set of points, with the outline of the reach.

/// Orthographic projection along one axis of W.
struct Projection {
  int right, up;  ///< indices of the W axes drawn to the right and upwards
  const char* name;
};

constexpr Projection kProjections[] = {{0, 1, "from above"}, {0, 2, "from the side"}};

/// View of the part of the cell that contains a set of points in W and the base [mm].
class CellView {
 public:
  CellView(const model::CellModel& cell, const std::vector<Vec3>& points_W);

  /// Side of the drawn square [mm].
  double extent_mm() const { return 2 * half_mm_; }

  /// Starts a panel: canvas, axes, base, and the data of kOutline.
  std::string Begin(const Projection& projection) const;

  /// First item of the panel's plot command: the outline of the tip's reach.
  static constexpr const char* kOutline =
      "$outline using 1:2 with lines linecolor rgb '#a9b4bb' linewidth 1";

 private:
  Vec3 base_mm_, centre_mm_;
  double half_mm_ = 0;
  std::vector<Vec3> reached_mm_;  ///< reachable tip positions, sampled within the joint limits
};

constexpr int kViewWidth = 300, kViewHeight = 215;
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
  std::ranges::sort(sorted);
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
    std::ranges::reverse(sorted);
  }
  return hull;
}

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
  script += fmt::format("set xtics {:.6g}\nset ytics {:.6g}\n", 2 * tic, tic);
  script += fmt::format(
      "set xlabel '{} (mm)' offset 0,0.9\nset ylabel '{} (mm)'\n"
      "set lmargin at screen 0.2\nset rmargin at screen 0.97\n"
      "set bmargin at screen 0.22\nset tmargin at screen 0.98\n",
      plot::kAxisNames[projection.right], plot::kAxisNames[projection.up]);
  const double x = base_mm_[projection.right], y = base_mm_[projection.up];
  script += fmt::format(
      "set label 1 '' at {:.6g},{:.6g} point pointtype 7 pointsize 0.6 linecolor rgb '{}'\n"
      "set label 2 'base' at {:.6g},{:.6g} offset 0.7,-0.7 font ',10' textcolor rgb '{}'\n",
      x, y, plot::kInk, x, y, plot::kInk);
  script += plot::Data("outline", Outline(reached_mm_, projection));
  return script;
}

constexpr double kArrowShare = 0.09;  // length of a large arrow as a share of the panel's width
constexpr double kLargeQuantile = 0.95;
constexpr double kWorthEnlarging = 4;  // minimum ratio of the two scale factors
constexpr std::size_t kMaxRivals = 3;  // drawn

/// 95th percentile of the arrows' lengths [mm].
double LargeArrow_mm(const std::vector<Vec3>& arrows) {
  if (arrows.empty()) return 0;
  std::vector<double> sizes;
  sizes.reserve(arrows.size());
  for (const Vec3& arrow : arrows) sizes.push_back(1e3 * arrow.norm());
  std::ranges::sort(sizes);
  return sizes[static_cast<std::size_t>(kLargeQuantile * static_cast<double>(sizes.size() - 1))];
}

double FactorFor(double large_mm, const CellView& view) {
  return large_mm > 0 ? plot::RoundDown(kArrowShare * view.extent_mm() / large_mm) : 1;
}

Panel ArrowPanel(const std::string& title, const CellView& view, const Projection& projection,
                 const std::vector<Vec3>& at, const std::vector<Vec3>& arrows, double factor,
                 double colour_to_mm) {
  std::vector<std::vector<double>> rows;
  for (std::size_t k = 0; k < at.size(); k += plot::Stride(at.size())) {
    const Vec3 from = 1e3 * at[k], arrow = 1e3 * factor * arrows[k];
    rows.push_back({from[projection.right], from[projection.up], arrow[projection.right],
                    arrow[projection.up], 1e3 * arrows[k].norm()});
  }
  Panel panel{title, "", view.Begin(projection), ""};
  panel.script += fmt::format("set cbrange [0:{:.6g}]\n", std::max(colour_to_mm, 1e-9));
  panel.script += plot::Data("arrows", rows);
  panel.script += std::string("plot ") + CellView::kOutline + (rows.empty() ? "\n" : ", ");
  if (rows.empty()) return panel;
  panel.script +=
      "$arrows using 1:2:3:4:5 with vectors head size screen 0.012,20,60 filled "
      "linecolor palette linewidth 1.1, "
      "$arrows using 1:2:5 with points pointtype 7 pointsize 0.18 linecolor palette\n";
  return panel;
}

/// Text at the end of a colour scale.
std::string DarkestText(double large_mm) {
  return MillimetreText(1e-3 * large_mm) + " mm and more";
}

std::string FactorText(double factor) {
  return fmt::format("{:g}", factor);
}

}  // namespace

PanelGroup ArrowFigures(const Diagnosis& diagnosis, const model::CellModel& cell) {
  std::vector<Vec3> at, before, after;
  for (const RowTrace& row : diagnosis.rows) {
    if (row.outlier) continue;
    at.push_back(row.p_measured);
    before.push_back(row.before);
    after.push_back(row.after);
  }
  const CellView view(cell, at);
  const double large_before = LargeArrow_mm(before), large_after = LargeArrow_mm(after);
  const double factor = FactorFor(large_before, view);
  const double factor_after = FactorFor(large_after, view);
  const bool corrected = !diagnosis.findings.empty();
  const bool enlarged = corrected && factor_after >= kWorthEnlarging * factor;
  PanelGroup group{{}, "", DarkestText(large_before), enlarged ? 3 : 2};
  for (const Projection& projection : kProjections) {
    const auto add = [&](const char* title, const std::vector<Vec3>& arrows, double by,
                         double large_mm) {
      group.panels.push_back(ArrowPanel(fmt::format("{}, {}", title, projection.name), view,
                                        projection, at, arrows, by, large_mm));
    };
    add(corrected ? "Before" : "Residual", before, factor, large_before);
    if (corrected) add("After", after, factor, large_before);
    if (enlarged) add("After, enlarged", after, factor_after, large_after);
  }
  const std::size_t stride = plot::Stride(at.size());
  group.caption = fmt::format(
      "Residual (measured minus predicted) at each measured point; arrows enlarged {} times{}. "
      "Outline: reach of the tip.{}{}",
      FactorText(factor), corrected ? ", at the same scale before and after" : "",
      stride > 1 ? fmt::format(" One row in {} is drawn.", stride) : std::string(),
      diagnosis.outlier_rows.empty() ? "" : " Outliers are not drawn.");
  if (enlarged) {
    group.colour_end += "; enlarged: " + DarkestText(large_after);
    group.caption += fmt::format(
        " On the right, the residual after correction is enlarged {} times: pure noise has no "
        "preferred direction; a pattern indicates an effect that the model lacks.",
        FactorText(factor_after));
  }
  return group;
}

PanelGroup RivalFigures(const Diagnosis& diagnosis, const model::CellModel& cell) {
  PanelGroup group;
  std::vector<std::vector<Vec3>> places;
  std::vector<Vec3> all;
  double large_mm = 0;
  const std::size_t drawn = std::min(diagnosis.rivals.size(), kMaxRivals);
  for (const Rival& rival : std::span(diagnosis.rivals).first(drawn)) {
    assert(rival.shift_W.size() == rival.rows.size());
    std::vector<Vec3>& at = places.emplace_back();
    for (const RowIndex row : rival.rows) at.push_back(diagnosis.rows[row].p_measured);
    all.insert(all.end(), at.begin(), at.end());
    large_mm = std::max(large_mm, LargeArrow_mm(rival.shift_W));
  }
  if (all.empty()) return group;
  const CellView view(cell, all);
  const double factor = FactorFor(large_mm, view);
  for (std::size_t k = 0; k < drawn; ++k) {
    if (places[k].empty()) continue;
    group.panels.push_back(ArrowPanel(Capitalized(RivalName(diagnosis.rivals[k])), view,
                                      kProjections[1], places[k], diagnosis.rivals[k].shift_W,
                                      factor, large_mm));
  }
  group.colour_end = DarkestText(large_mm);
  group.caption = fmt::format(
      "Prediction with {} minus that with the selected explanation at the measured points, from "
      "the side; arrows enlarged {} times.",
      diagnosis.rivals.size() > drawn ? fmt::format("the first {} alternatives", drawn)
                                      : std::string("each alternative"),
      FactorText(factor));
  return group;
}

PanelGroup NextPoseFigures(const Diagnosis& diagnosis, const model::CellModel& cell) {
  PanelGroup group;
  if (diagnosis.next_poses.empty()) return group;
  const kinematics::Chain chain(cell.robot);
  std::vector<std::vector<Vec3>> arms;
  std::vector<Vec3> all;
  for (const NextPose& pose : diagnosis.next_poses) {
    kinematics::Posture posture;
    chain.Evaluate(pose.q, posture);
    std::vector<Vec3> arm = {cell.robot.X_WB.p};
    for (int i = 0; i < posture.size; ++i) {
      arm.push_back(cell.robot.X_WB * posture.X_BL[i].p);
    }
    arm.push_back(cell.robot.X_WB * (posture.X_BF() * cell.tool.tcp_F));
    all.insert(all.end(), arm.begin(), arm.end());
    arms.push_back(std::move(arm));
  }
  const CellView view(cell, all);
  for (const Projection& projection : kProjections) {
    Panel panel{std::string("Proposed poses, ") + projection.name, "", view.Begin(projection), ""};
    std::string lines = std::string("plot ") + CellView::kOutline;
    for (std::size_t k = 0; k < arms.size(); ++k) {
      std::vector<std::vector<double>> points;
      for (const Vec3& p : arms[k]) {
        points.push_back({1e3 * p[projection.right], 1e3 * p[projection.up]});
      }
      panel.script += plot::Data(fmt::format("arm{}", k), points);
      const std::vector<double>& tip = points.back();
      panel.script += fmt::format(
          "set label {} '{}' at {:.6g},{:.6g} offset 0.6,0.4 textcolor rgb '{}' front\n", k + 10,
          k + 1, tip[0], tip[1], plot::kAccent);
      lines += fmt::format(
          ", $arm{} using 1:2 with lines linecolor rgb '{}' linewidth 1.6, "
          "$arm{} using 1:2 every ::{} with points pointtype 7 pointsize 0.5 linecolor rgb '{}'",
          k, plot::kGrey, k, points.size() - 1, plot::kAccent);
    }
    panel.script += lines + '\n';
    group.panels.push_back(panel);
  }
  group.caption = "The arm in the proposed poses; numbers mark the tip.";
  return group;
}

}  // namespace plumbline::measure
