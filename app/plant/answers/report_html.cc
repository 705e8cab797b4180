#include <fmt/format.h>

#include <algorithm>

#include "app/base/http/html_text.h"
#include "app/plant/answers/report_text.h"

namespace plumbline::plant {
namespace {

using http::EscapedHtml;

constexpr const char* kReportStyle = R"css(
:root { color-scheme: light dark; --ink: #15191c; --soft: #55606a; --edge: #c6ccd2; --ground: #fff;
  --mark: #8a5a00; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6e8eb; --soft: #b4bbc3; --edge: #4a525c;
  --ground: #1b1e23; --mark: #f5c04e; } }
body { font: 16px/1.45 system-ui, "DejaVu Sans", sans-serif; max-width: 62rem; margin: 2rem auto;
  padding: 0 1rem; color: var(--ink); background: var(--ground); overflow-wrap: anywhere; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.15rem; margin: 2rem 0 .3rem; break-after: avoid; }
p { color: var(--soft); margin: .3rem 0; max-width: 75ch; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: .15rem 1.2rem .15rem 0; border-bottom: 1px solid var(--edge);
  vertical-align: top; }
th { color: var(--soft); font-weight: 600; }
svg { width: 100%; height: auto; margin-top: .5rem; } svg text { fill: var(--soft); font-size: 12px; }
.axis { stroke: var(--edge); } .bar { stroke: var(--soft); stroke-width: 1.5; }
.dot { fill: var(--soft); } .mark.bar { stroke: var(--mark); stroke-width: 3; }
.mark.dot { fill: var(--mark); }
@media print { @page { size: A4; margin: 18mm; } body { max-width: none; margin: 0; font-size: 10pt; } }
)css";

std::string TableHtml(const ReportTable& table) {
  std::string html =
      fmt::format("<h2>{}</h2>\n<p>{}</p>\n", EscapedHtml(table.title), EscapedHtml(table.note));
  if (table.rows.empty()) return html;
  const auto row = [](const std::vector<std::string>& words, const char* tag) {
    std::string cells;
    for (const std::string& word : words) {
      cells += fmt::format("<{0}>{1}</{0}>", tag, EscapedHtml(word));
    }
    return "<tr>" + cells + "</tr>\n";
  };
  html += "<table>\n<thead>" + row(table.heads, "th") + "</thead>\n<tbody>\n";
  for (const auto& words : table.rows) html += row(words, "td");
  return html + "</tbody>\n</table>\n";
}

/// Every tested cell's slope with its interval, in order of the slope.
std::string SlopesPlot(const PlantReport& report) {
  constexpr double kWidth = 960, kHeight = 240, kLeft = 60, kBottom = 20;
  std::vector<const CellDrift*> drifts;
  double low = 0, high = 0;
  for (const CellDrift& drift : report.drifts) {
    drifts.push_back(&drift);
    low = std::min(low, kMonth_days * drift.size_mm.slope.low);
    high = std::max(high, kMonth_days * drift.size_mm.slope.high);
  }
  if (drifts.empty() || high <= low) return "";
  std::stable_sort(drifts.begin(), drifts.end(), [](const CellDrift* a, const CellDrift* b) {
    return a->size_mm.slope.value < b->size_mm.slope.value;
  });
  const auto y = [&](double mm) {
    return 10 + (kHeight - kBottom - 10) * (high - mm) / (high - low);
  };
  std::string svg = fmt::format(
      "<svg viewBox=\"0 0 {:.0f} {:.0f}\" role=\"img\" aria-label=\"Slopes of all tested "
      "cells\"><line class=\"axis\" x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\"/>",
      kWidth, kHeight, kLeft, kWidth, y(0), y(0));
  for (const double mm : {low, 0.0, high}) {
    svg += fmt::format("<text x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\">{:+.2f}</text>", kLeft - 6,
                       y(mm) + 4, mm);
  }
  const double step = (kWidth - kLeft) / static_cast<double>(drifts.size());
  for (std::size_t k = 0; k < drifts.size(); ++k) {
    const Interval& slope = drifts[k]->size_mm.slope;
    const double x = kLeft + step * (static_cast<double>(k) + 0.5);
    const char* const mark = drifts[k]->p_adjusted <= kSignificance ? "mark " : "";
    svg += fmt::format(
        "<g><title>{}</title><line class=\"{}bar\" x1=\"{:.1f}\" x2=\"{:.1f}\" y1=\"{:.1f}\" "
        "y2=\"{:.1f}\"/><circle class=\"{}dot\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.5\"/></g>",
        EscapedHtml(NameOf(*drifts[k]->cell)), mark, x, x, y(kMonth_days * slope.low),
        y(kMonth_days * slope.high), mark, x, y(kMonth_days * slope.value));
  }
  return svg +
         "</svg>\n<p>Each cell's slope of the mean residual [mm in 30 days] with its 95 % "
         "interval, "
         "in order. Thick bars: the cells listed above. A few intervals of many lie beside 0 by "
         "chance; the list allows for that.</p>\n";
}

}  // namespace

std::string ReportHtml(const ReportData& data, const PlantReport& report) {
  std::string html = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
      "'unsafe-inline'\">\n<title>Plumbline: report of the plant</title>\n<style>{}</style>\n"
      "</head>\n<body>\n<h1>Report of the plant</h1>\n<p>{}</p>\n",
      kReportStyle, EscapedHtml(ReportHeading(data, report)));
  for (const ReportTable& table : TablesOf(data, report)) {
    html += TableHtml(table);
    if (table.with_slopes) html += SlopesPlot(report);
  }
  return html + "</body>\n</html>\n";
}

}  // namespace plumbline::plant
