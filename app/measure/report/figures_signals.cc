// Figures of the residual against signals and of its periodic part.
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <span>

#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "app/measure/report/figures.h"
#include "app/measure/report/plot.h"
#include "app/measure/report/signal_bins.h"
#include "firmware-like/effects/parameter_name.h"

namespace plumbline::measure {
namespace {

constexpr int kFigureWidth = 300, kFigureHeight = 220, kUncorrectedHeight = 180;
constexpr int kSpectrumWidth = 170, kSpectrumHeight = 115;
constexpr double kSideMargin = 0.04;  // share of the signal's range
constexpr std::size_t kMaxSignals = 6;
constexpr std::ptrdiff_t kMostRemaining = 3;  // drawn first: those of the remaining residual
constexpr std::size_t kFewLines = 60;
constexpr double kLogFrom = 30;  // ratio of cycles from which the axis is logarithmic

/// One of a panel's two plots: points and binned means from a column of $points and $means.
std::string SignalPlot(const char* when, int column, const char* colour, double noise_mm,
                       const std::vector<double>& residual_mm) {
  const auto [low, high] = std::ranges::minmax_element(residual_mm);
  const double span = std::max(*high, noise_mm) - std::min(*low, -noise_mm);
  return fmt::format(
      "set ylabel '{0} (mm)'\nset ytics {5:.6g}\n"
      "plot {4:.6g} with lines linecolor rgb '{3}' dashtype 2, -{4:.6g} with lines linecolor rgb "
      "'{3}' dashtype 2, "
      "$points using 1:{1} with points pointtype 7 pointsize 0.3 linecolor rgb '{3}', "
      "$means using 1:{1} with linespoints pointtype 7 pointsize 0.35 linecolor rgb '{2}' "
      "linewidth 1.8\n",
      when, column, colour, plot::kGrey, noise_mm, plot::RoundDown(span / 2.2));
}

Panel SignalPanel(const Diagnosis& diagnosis, const Dependence& on) {
  const Cloud& cloud = on.cloud;
  const bool corrected = !diagnosis.findings.empty();
  Panel panel{
      SignalLabel(on.signal->name),
      fmt::format("in {}: {}{}; p\u00a0{}", plot::kAxisNames[on.axis], PercentText(on.share_before),
                  corrected ? " before, " + PercentText(on.share_after) + " after" : "",
                  on.PText()),
      plot::Begin(kFigureWidth, corrected ? kFigureHeight : kUncorrectedHeight), ""};
  if (cloud.value.empty()) return panel;
  std::vector<std::vector<double>> points, means;
  for (std::size_t k = 0; k < cloud.value.size(); k += plot::Stride(cloud.value.size())) {
    points.push_back({cloud.value[k], cloud.before[k], cloud.after[k]});
  }
  for (const Bin& bin : BinsOf(cloud)) {
    if (bin.after_gap) means.emplace_back();  // a blank line interrupts the curve
    means.push_back({bin.value, bin.before, bin.after});
  }
  const double low = cloud.value.front(), high = cloud.value.back();
  const double margin = high > low ? kSideMargin * (high - low) : 1;
  const double noise_mm = 2e3 * diagnosis.sigma_m;
  panel.script += plot::Data("points", points) + plot::Data("means", means);
  panel.script += fmt::format(
      "set xrange [{:.8g}:{:.8g}]\nset xtics {:.6g}\nset offsets 0, 0, graph 0.05, graph 0.05\n",
      low - margin, high + margin, plot::RoundDown(high > low ? (high - low) / 3 : 1));
  const std::string label = "set xlabel " + GnuplotQuoted(SignalLabel(on.signal->name)) + '\n';
  if (!corrected) {
    panel.script += label + SignalPlot("residual", 2, plot::kAccent, noise_mm, cloud.before);
    return panel;
  }
  panel.script +=
      "set multiplot\nset lmargin at screen 0.2\nset rmargin at screen 0.97\n"
      "set tmargin at screen 0.98\nset bmargin at screen 0.62\nset format x ''\n";
  panel.script += SignalPlot("before", 2, plot::kInk, noise_mm, cloud.before);
  panel.script +=
      "set tmargin at screen 0.55\nset bmargin at screen 0.2\nset format x '% h'\n" + label;
  panel.script +=
      SignalPlot("after", 3, plot::kAccent, noise_mm, cloud.after) + "unset multiplot\n";
  return panel;
}

/// Cycles per turn that the corrected model contains, by joint.
std::multimap<int, double> CyclesFound(const Diagnosis& diagnosis) {
  std::multimap<int, double> found;
  for (const Finding& finding : diagnosis.findings) {
    const effects::EffectTerm& term = finding.effect.term;
    for (std::size_t k = 0; k < finding.effect.values.size(); ++k) {
      const auto& spec = term.effect->traits().parameters[term.parameters[k].spec];
      if (spec.unit == "1/turn") {
        found.emplace(term.parameters[k].joint, finding.effect.values[k] / spec.to_SI);
      }
    }
  }
  return found;
}

}  // namespace

PanelGroup SignalFigures(const Diagnosis& diagnosis) {
  PanelGroup group;
  std::vector<Dependence> all = DependencesOf(diagnosis);
  const auto remaining = all.begin() + std::min(std::ssize(all), kMostRemaining);
  std::ranges::stable_sort(remaining, all.end(), std::greater<>(), &Dependence::share_before);
  for (const Dependence& on : std::span(all).first(std::min(all.size(), kMaxSignals))) {
    group.panels.push_back(SignalPanel(diagnosis, on));
  }
  group.caption = fmt::format(
      "Residual{} against the signals on which it depends most, each along the axis that depends "
      "on it most. Line: means over a tenth of the rows each; dashed: ±2 standard deviations of "
      "the noise. Percentage: share of the residual that these means explain, less what noise "
      "would. p: probability that pure noise would show at least the remaining dependence.",
      diagnosis.findings.empty() ? ""
                                 : " before (upper plot) and after correction (lower plot, on its "
                                   "own scale)");
  return group;
}

PanelGroup SpectrumFigures(const Diagnosis& diagnosis) {
  PanelGroup group{{}, "", "", 6};
  std::map<int, std::vector<std::vector<double>>> by_joint;
  double highest_urad = 0, least = 1e300, most = 0;
  for (const SpectralLine& line : diagnosis.spectrum) {
    by_joint[line.joint].push_back({line.cycles_per_turn, 1e6 * line.amplitude_rad});
    highest_urad = std::max(highest_urad, 1e6 * line.amplitude_rad);
    least = std::min(least, line.cycles_per_turn);
    most = std::max(most, line.cycles_per_turn);
  }
  const auto found = CyclesFound(diagnosis);
  for (auto& [joint, lines] : by_joint) {
    std::ranges::sort(lines);
    Panel panel{fmt::format("Axis {}", joint + 1), "", plot::Begin(kSpectrumWidth, kSpectrumHeight),
                ""};
    const bool logarithmic = least > 0 && most > kLogFrom * least;
    panel.script += fmt::format(
        "set yrange [0:{:.6g}]\nset ytics {:.6g}\n{}", std::max(1.1 * highest_urad, 1e-3),
        plot::RoundDown(std::max(highest_urad / 2, 1e-4)), logarithmic ? "set logscale x\n" : "");
    panel.script +=
        fmt::format("set xrange [{:.6g}:{:.6g}]\nset xtics {:.6g}\n", logarithmic ? least : 0, most,
                    logarithmic ? 10 : plot::RoundDown(most));
    int arrow = 1;
    const auto [first, last] = found.equal_range(joint);
    for (auto cycles = first; cycles != last; ++cycles, ++arrow) {
      panel.script += fmt::format(
          "set arrow {0} from {1:.6g}, graph 0 to {1:.6g}, graph 1 nohead dashtype 2 linecolor rgb "
          "'{2}'\n",
          arrow, cycles->second, plot::kInk);
    }
    panel.script += plot::Data("lines", lines);
    panel.script += fmt::format("plot $lines using 1:2 with {} linecolor rgb '{}' linewidth 1.2\n",
                                lines.size() <= kFewLines ? "impulses" : "lines", plot::kAccent);
    group.panels.push_back(panel);
  }
  group.caption =
      "Amplitude (µrad) of each joint's periodic part of the remaining residual against cycles per "
      "turn.";
  if (!found.empty()) group.caption += " Dashed: cycles that the corrected model contains.";
  return group;
}

}  // namespace plumbline::measure
