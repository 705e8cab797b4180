#include "app/display/view/tip_inset.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "app/display/view/palette.h"
#include "app/display/view/point_tiles.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::display {
namespace {

constexpr float kPlotHeights_em[] = {9, 7};  ///< tried in this order
constexpr float kPlotWidth_em = 15.4F, kSmallestImage_em = 22;

/// Geometry of the plot within the inset.
struct Plot {
  scene::Area area;
  scene::PicturePoint taught;  ///< [px]
  double px_per_mm;
  float em;
  float stroke() const { return std::max(1.5F, 0.09F * em); }
  scene::PicturePoint At(const lens::Vec2& mm) const {
    return {taught.x + static_cast<float>(px_per_mm * mm.x()),
            taught.y + static_cast<float>(px_per_mm * mm.y())};
  }
};

/// The plot with taught and uncorrected position centred, and the circle inside.
Plot PlotOf(const TipInset& inset, const scene::Area& area, float em) {
  Plot plot{area, {}, 1, em};
  const double u = inset.radius_mm, x = inset.uncorrected_mm.x(), y = inset.uncorrected_mm.y();
  const double left = std::min(-u, x), right = std::max(u, x);
  const double top = std::min(-u, y), bottom = std::max(u, y);
  const double margin = 3.0 * static_cast<double>(em);
  plot.px_per_mm =
      std::min((static_cast<double>(area.width) - margin) / std::max(right - left, 0.02),
               (static_cast<double>(area.height) - margin) / std::max(bottom - top, 0.02));
  const auto middle = [&](double low, double high) {
    return static_cast<float>(plot.px_per_mm * (low + high) / 2);
  };
  plot.taught = {area.x + area.width / 2 - middle(left, right),
                 area.y + area.height / 2 - middle(top, bottom)};
  return plot;
}

void AddScaleBar(const Plot& plot, PictureWriter& writer) {
  const double mm = RoundedDown125(3.5 * static_cast<double>(plot.em) / plot.px_per_mm);
  const auto length = static_cast<float>(mm * plot.px_per_mm);
  const float x = plot.area.x + 0.5F * plot.em, y = plot.area.bottom() - 0.5F * plot.em;
  const float tick = 0.25F * plot.em;
  writer.Stroke({{x, y - tick}, {x, y}, {x + length, y}, {x + length, y - tick}}, palette::kText,
                plot.stroke());
  writer.Text(x, y - tick - 1.25F * plot.em, 5 * plot.em, plot.em, fmt::format("{:g} mm", mm),
              palette::kText);
}

/// Directions of the axes of W, as far as they lie in the image plane.
void AddAxes(const TipInset& inset, const Plot& plot, PictureWriter& writer) {
  static constexpr std::array kNames = {"x", "y", "z"};
  const float arm = 1.4F * plot.em;
  const scene::PicturePoint from{plot.area.right() - 2.3F * plot.em, plot.area.y + 2.3F * plot.em};
  for (int k = 0; k < 3; ++k) {
    const lens::Vec2 along = inset.R_VW.col(k).head<2>();
    if (along.norm() < 0.35) continue;
    const auto dx = static_cast<float>(along.x()), dy = static_cast<float>(along.y());
    writer.Stroke({from, {from.x + arm * dx, from.y + arm * dy}}, palette::kFaded, plot.stroke());
    const float em = 0.8F * plot.em;
    writer.Text(from.x + 1.35F * arm * dx - 0.3F * em, from.y + 1.35F * arm * dy - 0.65F * em, em,
                em, kNames.at(static_cast<std::size_t>(k)), palette::kFaded);
  }
}

void AddMarks(const TipInset& inset, const Plot& plot, PictureWriter& writer) {
  const float mark = 0.32F * plot.em, thin = plot.stroke();
  const scene::PicturePoint missed = plot.At(inset.uncorrected_mm);
  writer.Stroke({plot.taught, missed}, palette::kUncorrected, thin);
  if (inset.radius_mm > 0) {
    writer.Circle(plot.taught, static_cast<float>(plot.px_per_mm * inset.radius_mm),
                  palette::kCorrected, thin);
  }
  writer.Circle(missed, mark, palette::kUncorrected, 1.5F * thin);
  writer.Disc(plot.taught, mark, palette::kCorrected);
  writer.Cross(plot.taught, 0.8F * plot.em, palette::kTaught, thin);
}

void AddKey(const TipInset& inset, const scene::Area& area, const Plot& plot,
            PictureWriter& writer) {
  const float half = area.width / 2, mark = 0.3F * plot.em, line = 1.3F * plot.em;
  const std::array names = {"taught", "uncorrected", "corrected", "95 % radius"};
  const std::size_t count = inset.radius_mm > 0 ? names.size() : names.size() - 1;
  for (std::size_t k = 0; k < count; ++k) {
    const float x = area.x + (k % 2 == 0 ? 0 : half), y = area.y + (k < 2 ? 0 : line);
    const scene::PicturePoint at{x + 0.7F * plot.em, y + 0.65F * plot.em};
    if (k == 0) writer.Cross(at, 1.3F * mark, palette::kTaught, plot.stroke());
    if (k == 1) writer.Circle(at, mark, palette::kUncorrected, 1.5F * plot.stroke());
    if (k == 2) writer.Disc(at, mark, palette::kCorrected);
    if (k == 3) writer.Circle(at, 1.5F * mark, palette::kCorrected, plot.stroke());
    writer.Text(x + 1.5F * plot.em, y, half - 1.5F * plot.em, plot.em, names.at(k), palette::kText);
  }
}

}  // namespace

double RoundedDown125(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  const double digit = value / power;
  return (digit >= 5 ? 5 : digit >= 2 ? 2 : 1) * power;
}

namespace {

/// Rows of a view of W: right, down, away.
Mat3 ViewAlongAxis(Eigen::Index away) {
  const Vec3 up = away == 2 ? Vec3::UnitY() : Vec3::UnitZ();
  const Vec3 right = away == 0 ? Vec3::UnitY() : Vec3::UnitX();
  Mat3 R;
  R << right.transpose(), -up.transpose(), right.cross(-up).transpose();
  return R;
}

/// The image plane, if known, if most of the correction lies in it, else the plane of W that shows
/// it best.
Mat3 ViewOf(const std::optional<Mat3>& R_CW, const Vec3& missed_W) {
  constexpr double kShown = 0.7;
  if (R_CW && (*R_CW * missed_W).head<2>().norm() >= kShown * missed_W.norm()) return *R_CW;
  Eigen::Index away = 0;
  missed_W.cwiseAbs().minCoeff(&away);
  return ViewAlongAxis(away);
}

}  // namespace

std::optional<TipInset> InsetOf(const OverlayInput& input, std::size_t k,
                                const lens::Lens& pinhole) {
  const ViewFacts& facts = input.facts;
  const cell::Carriers& carriers = facts.carriers[k];
  if (facts.model == nullptr || !carriers.tool) return std::nullopt;
  std::optional<Pose> X_CW;
  if (carriers.world) X_CW = carriers.world->X_CK;
  std::optional<TipInset> nearest;
  double least_m = 0;
  for (const correction::AssemblyPoint& point : facts.model->config.machine.points) {
    const double distance_m = (point.X_WP.p - carriers.tool->tip_W).norm();
    if (nearest && distance_m >= least_m) continue;
    for (const cell::ViewPoint& output : facts.state->points) {
      if (output.id != point.id || !output.valid) continue;
      least_m = distance_m;
      nearest.emplace();
      const Vec3 missed_W = -(facts.model->arm.X_WB().R * output.translation_B);
      nearest->name = PointName(facts, point.id);
      nearest->R_VW = ViewOf(X_CW ? std::optional(X_CW->R) : std::nullopt, missed_W);
      nearest->uncorrected_mm = kMmPerMetre * (nearest->R_VW * missed_W).head<2>();
      const bool known = output.basis != model::RadiusBasis::kUnknown;
      nearest->radius_mm = known ? kMmPerMetre * output.uncertainty_m : 0;
      const double depth_m = X_CW ? (*X_CW * point.X_WP.p).z() : 0;
      nearest->image_px_per_mm = depth_m > 0 ? pinhole.fx / (kMmPerMetre * depth_m) : 0;
    }
  }
  return nearest;
}

bool AddTipInset(const TipInset& inset, const scene::Area& image, LabelPlacer& placer,
                 PictureWriter& writer) {
  const float em = writer.layout().em, line = writer.layout().line(), margin = 0.4F * em;
  if (image.height < kSmallestImage_em * em || image.width < kSmallestImage_em * em) return false;
  std::optional<scene::Area> free;
  for (const float plot_em : kPlotHeights_em) {
    if (free) break;
    free = placer.TakeFreeCorner(
        kPlotWidth_em * em + 2 * margin, plot_em * em + 3 * line + 2 * margin,
        {Corner::kBottomRight, Corner::kTopRight, Corner::kTopLeft, Corner::kBottomLeft});
  }
  if (!free) return false;
  const scene::Area area = *free;
  const float side = area.height - 3 * line - 2 * margin;
  writer.Box(area, palette::kShadow);
  writer.Frame(area, std::max(1.0F, 0.06F * em), palette::kFaded);
  const float x = area.x + margin, inner = area.width - 2 * margin;
  const Plot plot = PlotOf(inset, {x, area.y + margin + line, inner, side}, em);
  const std::string zoom = inset.image_px_per_mm > 0
                               ? fmt::format(", ×{:.0f}", plot.px_per_mm / inset.image_px_per_mm)
                               : "";
  const float zoom_width = writer.WidthOf(zoom, em) + 1;
  const std::string name = writer.Shortened(inset.name, em, inner - zoom_width);
  writer.Text(x, area.y + margin, inner, em, name + zoom, palette::kText);
  AddMarks(inset, plot, writer);
  AddAxes(inset, plot, writer);
  AddScaleBar(plot, writer);
  AddKey(inset, {x, area.y + margin + line + side, inner, 2 * line}, plot, writer);
  return true;
}

}  // namespace plumbline::display
