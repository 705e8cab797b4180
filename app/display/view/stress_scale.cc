#include "app/display/view/stress_scale.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/display/view/palette.h"
#include "app/display/view/tip_inset.h"
#include "drivers/display/colour_scale.h"

namespace plumbline::display {
namespace {

constexpr int kSteps = 48;
constexpr float kWidth_em = 13;
constexpr double kPaPerMPa = 1e6;

double LargestStress_MPa(const cell::ToolState& tool) {
  float largest_Pa = 0;
  for (const scene::BendStation& station : tool.bend.stations)
    largest_Pa = std::max(largest_Pa, station.stress_Pa);
  return static_cast<double>(largest_Pa) / kPaPerMPa;
}

}  // namespace

std::vector<double> ScaleTicks(double full) {
  double step = RoundedDown125(full / 3.5);
  if (full / step > 7.5) step = RoundedDown125(2.5 * step);
  std::vector<double> ticks;
  for (int k = 0; k * step <= full * 1.0001; ++k) ticks.push_back(k * step);
  return ticks;
}

void AddStressScale(const OverlayInput& input, LabelPlacer& placer, PictureWriter& writer) {
  const cell::Carriers& carriers = input.facts.carriers.front();  // all cameras have the same tool
  const double full = input.config.stress_full_Pa / kPaPerMPa;
  if (!input.config.stress || !carriers.tool || carriers.robot_stale || !(full > 0)) return;
  const float em = writer.layout().em, line = writer.layout().line(), pad = 0.5F * em;
  const float ends = 1.2F * em;  // the first and last number are centred on the bar's ends
  const scene::Area area = placer.TakeCorner(
      kWidth_em * em + 2 * (pad + ends), 3.3F * line,
      {Corner::kBottomLeft, Corner::kTopLeft, Corner::kTopRight, Corner::kBottomRight});
  writer.Box(area, palette::kShadow);
  const float x = area.x + pad + ends, y = area.y + 1.35F * line, height = 0.6F * line;
  const float step = kWidth_em * em / kSteps;
  for (int k = 0; k < kSteps; ++k) {
    writer.Box({x + static_cast<float>(k) * step, y, step, height},
               display::StressColour((k + 0.5) / kSteps));
  }
  const auto at = [&](double MPa) {
    return x + static_cast<float>(std::clamp(MPa / full, 0.0, 1.0)) * kWidth_em * em;
  };
  const float thin = std::max(1.5F, 0.07F * em), y_tick = y + height;
  for (const double tick : ScaleTicks(full)) {
    writer.Stroke({{at(tick), y_tick}, {at(tick), y_tick + 0.3F * em}}, palette::kText, thin);
    const std::string number = fmt::format("{:g}", tick);
    const float width = writer.WidthOf(number, em) + 1;
    writer.Text(at(tick) - width / 2, y_tick + 0.25F * em, width, em, number, palette::kText);
  }
  const double largest = LargestStress_MPa(*carriers.tool);
  const float mark = at(largest), up = 0.35F * em;
  writer.Stroke({{mark - up, y - up}, {mark, y}, {mark + up, y - up}}, palette::kText, 2 * thin);
  const PanelLine title =
      largest > full
          ? PanelLine{fmt::format("stress {:.1f} MPa: off scale", largest), Tone::kAttention}
          : PanelLine{fmt::format("stress, at most {:.1f} MPa", largest), Tone::kPlain};
  writer.Line(area.x + pad, area.y, area.width - 2 * pad, title);
}

}  // namespace plumbline::display
