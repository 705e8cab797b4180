#include "app/measure/report/report.h"

#include <fmt/format.h>

#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "app/measure/report/certificate.h"
#include "app/measure/report/certificate_layout.h"
#include "app/measure/report/html.h"
#include "app/measure/report/sections.h"

namespace plumbline::measure {
namespace {

// Style sheet of the report, for screen, phone and print.

constexpr const char* kReportStyle = R"css(
:root { --ink: #25313a; --soft: #5c6b75; --line: #dbe2e6; --accent: #0b6e8f; --tint: #f3f7f9; }
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; }
body { margin: 0; color: var(--ink); background: #fff;
  font: 16px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif; }
main { max-width: 1040px; margin: 0 auto; padding: 40px 28px 64px; }
header p { margin: 0; color: var(--soft); }
h1 { font-size: 1.55rem; font-weight: 600; margin: 0 0 4px; line-height: 1.25; }
h2 { font-size: 1.12rem; font-weight: 600; margin: 48px 0 10px; padding-top: 14px;
  border-top: 1px solid #dbe2e6; break-after: avoid; }
h3 { font-size: 1rem; font-weight: 600; margin: 24px 0 6px; break-after: avoid; }
p { margin: 0 0 12px; max-width: 74ch; }
ul { margin: 0 0 12px; padding-left: 20px; max-width: 74ch; }
.soft, figcaption, .legend { color: var(--soft); font-size: 0.875rem; }
.table { overflow-x: auto; margin: 0 0 12px; }
table { border-collapse: collapse; font-size: 0.9rem; line-height: 1.4;
  font-variant-numeric: tabular-nums; }
th { text-align: left; font-weight: 600; color: var(--soft); font-size: 0.8125rem;
  border-bottom: 1px solid #25313a; vertical-align: bottom; }
th, td { padding: 5px 18px 5px 0; }
td { border-bottom: 1px solid #dbe2e6; vertical-align: top; }
th:last-child, td:last-child { padding-right: 0; }
.number { text-align: right; }
td.number { white-space: nowrap; }
.strong td { font-weight: 600; }
figure { margin: 8px 0 20px; }
.panel table { width: 100%; font-size: 0.8rem; }
.panel th, .panel td { padding-right: 8px; }
sup { line-height: 0; }
.panels { display: grid; gap: 14px 24px; grid-template-columns: repeat(3, 1fr); }
.panels.across2 { grid-template-columns: repeat(2, 1fr); }
.panels.across6 { grid-template-columns: repeat(6, 1fr); gap: 14px 8px; }
.panel { break-inside: avoid; min-width: 0; }
.panel p { margin: 0; font-size: 0.875rem; font-weight: 600; overflow-wrap: anywhere; }
.panel p.soft { font-size: 0.8125rem; font-weight: 400; }
.panel svg { display: block; width: 100%; height: auto; }
.panel svg text { font-family: system-ui, -apple-system, "Segoe UI", Roboto, Arial, sans-serif; }
figcaption { margin-top: 6px; max-width: 84ch; }
.legend { display: flex; align-items: center; gap: 8px; margin-top: 6px; }
.legend i { width: 140px; height: 8px;
  background: linear-gradient(90deg, #c4d3da, #2f8aa8 40%, #06303f);
  -webkit-print-color-adjust: exact; print-color-adjust: exact; }
.note { padding: 10px 14px; border: 1px solid #dbe2e6; max-width: 74ch; }
footer { margin-top: 48px; padding-top: 12px; border-top: 1px solid #dbe2e6;
  color: var(--soft); font-size: 0.8125rem; }
.certificate { max-width: 820px; margin: 0 auto; font-size: 0.875rem; line-height: 1.35; }
.certificate p { max-width: none; margin: 0 0 4px; }
.certificate h1, .certificate p, .certificate td { overflow-wrap: anywhere; }
.certificate h1 { font-size: 1.3rem; }
.certificate table { font-size: 0.8125rem; line-height: 1.3; width: 100%; }
.certificate th { font-size: 0.75rem; }
.certificate th, .certificate td { padding: 2px 10px 2px 0; }
.certificate .table { margin: 0 0 3px; overflow-wrap: normal; }
.certificate .soft { font-size: 0.75rem; }
.columns > tbody > tr > td { border: 0; padding: 0; }
.good { --state: #1f6f43; }
.caution { --state: #8f5f00; }
.bad { --state: #a3271c; }
.neutral { --state: #5b6570; }
.headline, .second { margin: 8px 0 6px; padding: 8px 14px 7px; }
.headline { color: #fff; background-color: var(--state); }
.second { background: var(--tint); border-left-width: 6px; border-left-style: solid;
  border-left-color: var(--state); }
.second .word { color: var(--state); }
.certificate .word { font-size: 1rem; font-weight: 700; letter-spacing: 0.06em;
  text-transform: uppercase; margin: 0; }
.certificate .headline .word { font-size: 1.5rem; line-height: 1.2; }
.certificate .sentence { font-weight: 600; }
.columns .left { width: 58%; padding-right: 12px; }
.particulars th { border-bottom: 1px solid #dbe2e6; white-space: nowrap; font-weight: 400;
  vertical-align: top; }
.particulars td { overflow-wrap: anywhere; }
.plot { margin: 6px 0 2px; }
.plot p { font-size: 0.75rem; line-height: 1.3; }
.plot svg { display: block; width: 100%; height: auto; overflow: visible; }
.pair { display: grid; gap: 8px 0; grid-template-columns: repeat(auto-fit, minmax(min(100%, 300px), 1fr)); }
.plot svg text { font-family: system-ui, -apple-system, "Segoe UI", Roboto, Arial, sans-serif; }
.blank { display: inline-block; width: 90%; min-width: 60px; border-bottom: 1px solid #25313a; }
.approval td { width: 33%; border: 0; color: var(--soft); font-size: 0.75rem; }
.approval .blank { height: 22px; }
.certificate .digest { font: 0.625rem/1.4 "DejaVu Sans Mono", monospace; color: var(--soft);
  overflow-wrap: anywhere; margin: 4px 0 0; }
h2.appendix { font-size: 1.3rem; border: 0; }
@media (max-width: 800px) {
  .panels, .panels.across2 { grid-template-columns: 1fr; }
  .panels.across6 { grid-template-columns: repeat(2, 1fr); }
}
@media (max-width: 600px) {
  main { padding: 22px 16px 40px; }
  h1 { font-size: 1.3rem; }
  table { font-size: 0.82rem; }
  th, td { padding-right: 10px; }
  /* Tables beside each other become one below the other; texts of a wide plot keep their size. */
  .columns, .columns > tbody, .columns > tbody > tr,
  .columns > tbody > tr > td { display: block; width: 100%; }
  .columns .left { width: 100%; padding: 0 0 10px; }
  .certificate .table td:first-child { min-width: 7.5em; }
  .certificate .table table { font-size: 0.75rem; }
  .certificate .table th, .certificate .table td { padding-right: 6px; }
  .wide svg text { font-size: 18px; }
}
@media print {
  @page { size: A4; margin: 8mm 15mm 11mm;
    @bottom-right { content: counter(page) " / " counter(pages);
      font: 8pt "DejaVu Sans", sans-serif; color: #5c6b75; } }
  body { font-size: 8pt; line-height: 1.35; }
  main { max-width: none; padding: 0; }
  p, ul, figcaption { max-width: none; margin-bottom: 3pt; }
  h2 { font-size: 11pt; margin: 7pt 0 3pt; padding-top: 3pt; }
  figure { margin: 0 0 4pt; }
  .headline, .second, .legend i {
    -webkit-print-color-adjust: exact; print-color-adjust: exact; }
  .certificate { max-width: none; font-size: 9pt; break-after: page; }
  .certificate h1 { font-size: 14pt; }
  .certificate table, .certificate th { font-size: 8pt; }
  footer { margin-top: 8pt; padding-top: 4pt; font-size: 7.5pt; break-before: avoid; }
  .certificate .soft, .plot p { font-size: 7.5pt; }
  .certificate .word { font-size: 9.5pt; }
  .certificate .headline .word { font-size: 15pt; }
  .certificate .digest { font-size: 6pt; }
  .certificate p.soft { break-before: auto; }
  .certificate p { margin-bottom: 2pt; }
  .headline, .second { margin: 4pt 0; padding: 4pt 10pt 3pt; }
  .pair { display: block; white-space: nowrap; font-size: 0; }
  .pair svg { display: inline-block; width: 50%; }
  .plot { margin: 3pt 0 0; }
  .certificate, .certificate table, .plot p { line-height: 1.2; }
  .headline p, .second p { margin-bottom: 1pt; }
  .particulars th { padding-right: 4pt; }
  .approval .blank { height: 16pt; }
  h2.appendix { margin-top: 0; padding-top: 0; }
  table { font-size: 7.5pt; line-height: 1.25; }
  th { font-size: 7.5pt; }
  th, td { padding: 0.7pt 8pt 0.7pt 0; }
  .table { margin-bottom: 4pt; overflow: visible; }
  .panel table, .panel th { font-size: 7pt; }
  .panel th, .panel td { padding-right: 4pt; }
  .parameters td + td { white-space: nowrap; }
  .certificate th, .certificate td { padding: 1pt 6pt 1pt 0; }
  .certificate .left .number { padding-right: 4pt; }
  .legend span, .legend i { display: inline-block; margin-right: 6mm; }
  .legend { display: block; }
  thead { display: table-header-group; }
  tr, .panel, .note, .legend, figcaption, .whole { break-inside: avoid; }
  .legend, figcaption, p.soft { break-before: avoid; }
  h2 + p { break-after: avoid; }
  p { orphans: 3; widows: 3; }
  /* At least two rows on either side of a page break. */
  tbody tr:first-child { break-after: avoid; }
  tbody tr:last-child { break-before: avoid; }
  figcaption, .legend, .soft { font-size: 7.5pt; }
  figcaption, .legend { margin-top: 2pt; }
  .panels { display: block; font-size: 0; orphans: 1; widows: 1; }
  .panel { display: inline-block; vertical-align: top; width: 32%; margin: 0 1.3% 3pt 0; }
  .panels.across2 .panel { width: 48%; }
  .panels.across6 .panel { width: 15.6%; margin-right: 1%; }
  .panel p { font-size: 8pt; line-height: 1.2; }
  .panel p.soft { font-size: 7pt; }
}
)css";

/// All figures of the report.
struct Pictures {
  PanelGroup rivals, poses, arrows, signals, spectrum;
  CertificateFigure points, deciding;
  std::string fault;  ///< why there are no figures; empty: there are

  std::vector<Panel*> Panels() {
    std::vector<Panel*> panels;
    for (std::vector<Panel>* group :
         {&rivals.panels, &poses.panels, &arrows.panels, &signals.panels, &spectrum.panels,
          &points.panels, &deciding.panels}) {
      for (Panel& panel : *group) panels.push_back(&panel);
    }
    return panels;
  }
};

/// The certificate's figures, as high as its texts permit.
void AddCertificateFigures(const Diagnosis& diagnosis, const model::CellModel& cell,
                           const ReportSource& source, const AchievedAccuracy& achieved,
                           Pictures& pictures) {
  const std::optional<double>& tolerance_m = source.certificate_details.tolerance_m;
  pictures.points = PointsFigure(achieved, tolerance_m);
  pictures.deciding = DecidingFigure(diagnosis, cell);
  const FigureHeights heights =
      HeightsBeside(CertificateTextHeight_mm({diagnosis, cell, source, achieved, pictures.points,
                                              pictures.deciding, pictures.fault}),
                    !pictures.points.panels.empty());
  pictures.points = PointsFigure(achieved, tolerance_m, heights.points);
  pictures.deciding = DecidingFigure(diagnosis, cell, heights.deciding);
}

Pictures Draw(const Diagnosis& diagnosis, const model::CellModel& cell,
              const AchievedAccuracy& achieved, const ReportSource& source,
              const GnuplotOptions& gnuplot) {
  Pictures pictures;
  AddCertificateFigures(diagnosis, cell, source, achieved, pictures);
  pictures.arrows = ArrowFigures(diagnosis, cell);
  pictures.signals = SignalFigures(diagnosis);
  pictures.spectrum = SpectrumFigures(diagnosis);
  pictures.poses = NextPoseFigures(diagnosis, cell);
  pictures.rivals = RivalFigures(diagnosis, cell);
  std::string script;
  const std::vector<Panel*> panels = pictures.Panels();
  for (const Panel* panel : panels) script += panel->script;
  const auto svgs = DrawSvgs(script, gnuplot);
  if (!svgs) {
    pictures.fault = svgs.error();
  } else if (svgs->size() != panels.size()) {
    pictures.fault =
        fmt::format("{} drew {} of {} figures", gnuplot.program, svgs->size(), panels.size());
  } else {
    for (std::size_t k = 0; k < panels.size(); ++k) {
      panels[k]->svg = InlineSvg((*svgs)[k], fmt::format("p{}", k + 1), panels[k]->title);
    }
  }
  return pictures;
}

/// A section with its heading; empty if it has no content.
std::string Chapter(const std::string& title, const std::string& content) {
  return content.empty() ? "" : "<section>\n<h2>" + title + "</h2>\n" + content + "</section>\n";
}

std::string Head(const model::CellModel& cell) {
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
         "<title>Diagnosis: " +
         Escape(cell.robot.name) + "</title>\n<style>" + kReportStyle + "</style>\n</head>\n";
}

}  // namespace

std::string ReportHtml(const Diagnosis& diagnosis, const model::CellModel& cell,
                       const ReportSource& source, const GnuplotOptions& gnuplot) {
  const AchievedAccuracy achieved = AchievedAccuracyOf(diagnosis, cell);
  const Pictures pictures = Draw(diagnosis, cell, achieved, source, gnuplot);
  std::string html = Head(cell) + "<body>\n<main>\n";
  html += CertificatePage(
      {diagnosis, cell, source, achieved, pictures.points, pictures.deciding, pictures.fault});
  html += "<h2 class=\"appendix\">Appendix</h2>\n";
  html += Chapter("Reservations", ListHtml(Reservations(diagnosis)));
  html += Chapter("Data", DataTable(diagnosis, source));
  html += Chapter("Residuals before and after correction", ErrorTable(diagnosis));
  html += Chapter("Effects found", EffectsBlock(diagnosis));
  html += Chapter("Correlation of the parameters", CorrelationBlock(diagnosis));
  const std::string considered =
      Chapter("Effects considered, and detection limits", ConsideredTable(diagnosis));
  // If nothing was found, the detection limits are the result; otherwise they come with the
  // reasons.
  const bool nothing = diagnosis.verdict == Verdict::kNoEffect;
  if (nothing) html += considered;
  html += Chapter("Alternative explanations that fit equally well",
                  RivalsTable(diagnosis) + FigureHtml(pictures.rivals));
  html +=
      Chapter("What to measure next", NextPosesTable(diagnosis, cell) + FigureHtml(pictures.poses));
  html += Chapter("Measurement uncertainty", BudgetTable(achieved, diagnosis));
  html += Chapter("Error at each measured pose",
                  PosesTable(achieved, source.certificate_details.tolerance_m));
  html += Chapter("Residuals in the cell", FigureHtml(pictures.arrows));
  html += Chapter("Residuals against each signal",
                  FigureHtml(pictures.signals) + SignalsTable(diagnosis));
  html += Chapter("Periodic joint errors", FigureHtml(pictures.spectrum));
  if (!nothing) html += considered;
  html += Chapter("Outliers", OutlierTable(diagnosis));
  html += Chapter("Remarks", RemarksList(diagnosis));
  return html + "<footer>Created by Plumbline " + Escape(source.version) +
         ". Lengths in mm, angles in the units stated; W is the measurement frame.</footer>\n"
         "</main>\n</body>\n</html>\n";
}

}  // namespace plumbline::measure
