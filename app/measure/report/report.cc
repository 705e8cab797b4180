#include "app/measure/report/report.h"

#include <fmt/format.h>

#include "app/measure/diagnosis/diagnosis_text.h"
#include "app/measure/report/certificate.h"
#include "app/measure/report/certificate_layout.h"
#include "app/measure/report/html.h"
#include "app/measure/report/sections.h"
#include "app/measure/report/style.h"

namespace plumbline::measure {
namespace {

/// All figures of the report.
struct Pictures {
  std::vector<PanelGroup> arrows;
  PanelGroup signals, spectrum, poses;
  std::vector<PanelGroup> rivals;
  CertificateFigure points, deciding;
  std::string fault;  ///< why there are no figures; empty: there are

  std::vector<Panel*> Panels() {
    std::vector<Panel*> panels;
    const auto add = [&panels](PanelGroup& group) {
      for (Panel& panel : group.panels) panels.push_back(&panel);
    };
    for (PanelGroup& group : arrows) add(group);
    for (PanelGroup* group : {&signals, &spectrum, &poses}) add(*group);
    for (PanelGroup& group : rivals) add(group);
    for (CertificateFigure* figure : {&points, &deciding}) {
      if (!figure->panel.script.empty()) panels.push_back(&figure->panel);
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
                    !pictures.points.panel.script.empty());
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
  for (const Rival& rival : diagnosis.rivals) {
    pictures.rivals.push_back(RivalFigures(diagnosis, rival, cell));
  }
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

std::string ArrowsHtml(const Pictures& pictures) {
  std::string html;
  for (const PanelGroup& group : pictures.arrows) html += FigureHtml(group);
  return html;
}

std::string RivalsHtml(const Diagnosis& diagnosis, const Pictures& pictures) {
  std::string html;
  for (std::size_t k = 0; k < diagnosis.rivals.size(); ++k) {
    const Rival& rival = diagnosis.rivals[k];
    html += "<div class=\"whole\">\n<h3>" + Escape(Capitalized(RivalName(rival))) +
            " in place of " + Escape(ReplacedName(rival)) + "</h3>\n";
    html += RivalText(rival) + FigureHtml(pictures.rivals[k]) + "</div>\n";
  }
  return html;
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
  html += "<h2 class=\"appendix\">Appendix</h2>\n" + VerdictBlock(diagnosis);
  html += Chapter("Residuals before and after correction", ErrorTable(diagnosis));
  html += Chapter("Effects found", EffectsBlock(diagnosis));
  html += Chapter("Measurement uncertainty", BudgetTable(achieved, diagnosis));
  html += Chapter("Error at each measured pose",
                  PosesTable(achieved, source.certificate_details.tolerance_m));
  const std::string detectable = Chapter("Detection limits", DetectableTable(diagnosis));
  // If nothing was found, the detection limits are the result; otherwise they come with the
  // reasons.
  const bool nothing = diagnosis.verdict == Verdict::kNoEffect;
  if (nothing) html += detectable;
  html +=
      Chapter("Alternative explanations that fit equally well", RivalsHtml(diagnosis, pictures));
  html +=
      Chapter("What to measure next", NextPosesTable(diagnosis, cell) + FigureHtml(pictures.poses));
  html += Chapter("Residuals in the cell", ArrowsHtml(pictures));
  html += Chapter("Residuals against each signal", FigureHtml(pictures.signals));
  html += Chapter("Periodic joint errors", FigureHtml(pictures.spectrum));
  html += Chapter("Effects considered", ConsideredTable(diagnosis));
  if (!nothing) html += detectable;
  html += Chapter("Correlation of the parameters", CorrelationBlock(diagnosis));
  html += Chapter("Signals not recorded", NotRecordedList(diagnosis));
  html += Chapter("Outliers", OutlierTable(diagnosis));
  html += Chapter("Remarks", NotesList(diagnosis));
  html += Chapter("Data", DataTable(diagnosis, cell, source));
  return html + "<footer>Created by Plumbline " + Escape(source.version) +
         ". Lengths in mm, angles in the units stated; W is the measurement frame.</footer>\n"
         "</main>\n</body>\n</html>\n";
}

}  // namespace plumbline::measure
