#include "app/report/report.h"

#include <fmt/format.h>

#include "app/diagnosis/words.h"
#include "app/report/html.h"
#include "app/report/sections.h"
#include "app/report/style.h"

namespace plumbline {
namespace {

/// Everything that is drawn.
struct Pictures {
  std::vector<PanelGroup> arrows;
  PanelGroup signals, spectrum, poses;
  std::vector<PanelGroup> rivals;
  std::string fault;  ///< empty, or why there are none

  std::vector<Panel*> Panels() {
    std::vector<Panel*> panels;
    const auto add = [&panels](PanelGroup& group) {
      for (Panel& panel : group.panels) panels.push_back(&panel);
    };
    for (PanelGroup& group : arrows) add(group);
    for (PanelGroup* group : {&signals, &spectrum, &poses}) add(*group);
    for (PanelGroup& group : rivals) add(group);
    return panels;
  }
};

Pictures Draw(const Diagnosis& diagnosis, const CellModel& cell, const GnuplotOptions& gnuplot) {
  Pictures pictures;
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
        fmt::format("{} drew {} of {} pictures", gnuplot.program, svgs->size(), panels.size());
  } else {
    for (std::size_t k = 0; k < panels.size(); ++k) {
      panels[k]->svg = InlineSvg((*svgs)[k], fmt::format("p{}", k + 1), panels[k]->title);
    }
  }
  return pictures;
}

/// A section with its heading; nothing where it has no content.
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
    html += "<h3>" + Escape(Capital(RivalName(rival))) + " in place of " +
            Escape(ReplacedName(rival)) + "</h3>\n";
    html += RivalText(rival) + FigureHtml(pictures.rivals[k]);
  }
  return html;
}

std::string Head(const CellModel& cell) {
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
         "<title>Diagnosis: " +
         Escape(cell.robot.name) + "</title>\n<style>" + kReportStyle + "</style>\n</head>\n";
}

}  // namespace

std::string ReportHtml(const Diagnosis& diagnosis, const CellModel& cell,
                       const ReportSource& source, const GnuplotOptions& gnuplot) {
  const Pictures pictures = Draw(diagnosis, cell, gnuplot);
  std::string html = Head(cell) + "<body>\n<main>\n<header>\n<h1>" + Escape(cell.robot.name) +
                     "</h1>\n<p>Diagnosis of " + fmt::format("{}", diagnosis.rows.size()) +
                     " measured points, " + Escape(source.data_file) + ", " + Escape(source.date) +
                     "</p>\n</header>\n";
  html += VerdictBlock(diagnosis);
  if (!pictures.fault.empty()) {
    html += "<p class=\"note\">This report has no pictures: " + Escape(pictures.fault) +
            ". Mend that and run the diagnosis again with --report.</p>\n";
  }
  html += Chapter("Error before and after", ErrorTable(diagnosis));
  html += Chapter("What was found", EffectsBlock(diagnosis));
  const std::string detectable = Chapter("What would have been seen", DetectableTable(diagnosis));
  // Where nothing was found, that is the answer; else it stands with the reasons.
  const bool nothing = diagnosis.verdict == Verdict::kNoEffect;
  if (nothing) html += detectable;
  html += Chapter("Other explanations that fit as well", RivalsHtml(diagnosis, pictures));
  html +=
      Chapter("What to measure next", NextPosesTable(diagnosis, cell) + FigureHtml(pictures.poses));
  html += Chapter("The residual in the cell", ArrowsHtml(pictures));
  html += Chapter("The residual against each signal", FigureHtml(pictures.signals));
  html += Chapter("Periods of the joints", FigureHtml(pictures.spectrum));
  html += Chapter("Effects considered", ConsideredTable(diagnosis));
  if (!nothing) html += detectable;
  html += Chapter("Correlation of the parameters", CorrelationBlock(diagnosis));
  html += Chapter("Not recorded", NotRecordedList(diagnosis));
  html += Chapter("Outliers", OutlierTable(diagnosis));
  html += Chapter("Remarks", NotesList(diagnosis));
  html += Chapter("Data", DataTable(diagnosis, cell, source));
  return html + "<footer>Made by Plumbline " + Escape(source.version) +
         ". Lengths in mm, angles as named; W is the measurement frame.</footer>\n"
         "</main>\n</body>\n</html>\n";
}

}  // namespace plumbline
