// Report sections on the evidence: candidates, rivals, proposed poses, outliers, data.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "app/base/text/text.h"
#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "app/measure/report/html.h"
#include "app/measure/report/sections.h"
#include "app/measure/report/words.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline::measure {
namespace {

constexpr std::size_t kMaxOutliers = 40;
constexpr double kNever_s = 1e300;

bool Offered(const CandidateOutcome& considered) {
  return considered.taken || considered.chi2_drop != 0 || considered.evidence_gap != 0;
}

/// Empty if no explanation contains the effect and none was cut off.
std::string GapText(const CandidateOutcome& one) {
  const double gap = one.evidence_gap;
  if (one.taken || !Offered(one) || (gap == 0 && one.parameters == 0)) return "";
  return (one.gap_is_lower_bound ? "&gt; " : "") +
         NumberHtml(fmt::format("{:.{}f}", gap, std::abs(gap) < 10 ? 1 : 0));
}

/// Selected effects first, then by evidence; effects that were not candidates last.
bool Before(const CandidateOutcome& a, const CandidateOutcome& b) {
  if (a.taken != b.taken) return a.taken;
  if (Offered(a) != Offered(b)) return Offered(a);
  return a.evidence_gap > b.evidence_gap;
}

}  // namespace

std::string ConsideredTable(const Diagnosis& diagnosis) {
  if (diagnosis.considered.empty()) return "";
  std::vector<CandidateOutcome> all = diagnosis.considered;
  std::ranges::stable_sort(all, &Before);
  HtmlTable table({"Effect", "Parameters", "Explains alone", "Evidence gap", "Outcome"}, {0, 4});
  for (const CandidateOutcome& one : all) {
    const bool offered = Offered(one);
    table.AddRow({Escape(Capitalized(EffectName(one.id, one.scope))),
                  offered ? fmt::format("{}", one.parameters) : "",
                  offered ? Escape(PercentText(one.signal_share)) : "", GapText(one),
                  Escape(InWords(one.reason, diagnosis))},
                 one.taken);
  }
  return table.Html() +
         "<p class=\"soft\">Explains alone: share of the residual, after alignment of the frames, "
         "that this effect explains as the only one. Evidence gap: score of the best explanation "
         "that contains the effect minus the best score overall; a gap of 16 (four standard "
         "deviations) rules the effect out.</p>\n";
}

std::string RivalText(const Rival& rival) {
  return fmt::format(
      "<p>After refitting, {} reproduces {} of the displacement that {} causes at these "
      "points; its score differs by {} from that of the selected explanation.</p>\n",
      Escape(RivalName(rival)), Escape(PercentText(std::max(0.0, 1 - rival.signal_left))),
      Escape(ReplacedName(rival)), NumberHtml(fmt::format("{:+.1f}", rival.evidence_gap)));
}

std::string NextPosesTable(const Diagnosis& diagnosis, const model::CellModel& cell) {
  if (diagnosis.next_poses.empty()) return "";
  std::vector<std::string> headers = {"Pose"};
  for (int i = 0; i < cell.robot.size(); ++i) {
    const bool prismatic = cell.robot.joints[i].type == model::JointType::kPrismatic;
    headers.push_back(fmt::format("Joint {} ({})", i + 1, prismatic ? "mm" : "&deg;"));
  }
  headers.insert(headers.end(), {"Payload (kg)", "How to measure", "Separation (mm)"});
  HtmlTable table(headers, {});
  for (std::size_t k = 0; k < diagnosis.next_poses.size(); ++k) {
    const NextPose& pose = diagnosis.next_poses[k];
    std::vector<std::string> cells = {fmt::format("{}", k + 1)};
    for (int i = 0; i < cell.robot.size(); ++i) {
      const model::JointType type = cell.robot.joints[i].type;
      cells.push_back(
          NumberHtml(fmt::format("{:.2f}", pose.q[i] * model::PositionForm(type).from_SI)));
    }
    cells.push_back(fmt::format("{:.1f}", pose.payload_kg));
    cells.push_back(Escape(InWords(MeasuringText(pose), diagnosis)));
    cells.push_back(Escape(MillimetreText(pose.separation_m)));
    table.AddRow(cells);
  }
  return "<p>Measure these poses and run the diagnosis again with old and new rows in one file. "
         "Check each pose for collisions before moving the robot there.</p>\n" +
         table.Html() +
         "<p class=\"soft\">Separation: difference between the predictions of the explanations in "
         "that pose.</p>\n";
}

std::string RemarksList(std::vector<std::string> remarks, const Diagnosis& diagnosis) {
  for (std::string& remark : remarks) remark = InWords(remark, diagnosis);
  return ListHtml(remarks);
}

std::string OutlierTable(const Diagnosis& diagnosis) {
  if (diagnosis.outlier_rows.empty()) return "";
  const std::set<int> lines(diagnosis.outlier_rows.begin(), diagnosis.outlier_rows.end());
  const bool sessions =
      std::ranges::any_of(diagnosis.rows, [](const RowTrace& row) { return !row.session.empty(); });
  std::vector<std::string> headers = {"Line", "Before (mm)", "After (mm)", "Weight"};
  if (sessions) headers.emplace_back("Session");
  HtmlTable table(headers, {4});
  std::size_t count = 0;
  for (const RowTrace& row : diagnosis.rows) {
    if (!lines.contains(row.line) || ++count > kMaxOutliers) continue;
    std::vector<std::string> cells = {
        fmt::format("{}", row.line), Escape(MillimetreText(row.before.norm())),
        Escape(MillimetreText(row.after.norm())), fmt::format("{:.2f}", row.weight)};
    if (sessions) cells.push_back(Escape(row.session));
    table.AddRow(cells);
  }
  std::string html =
      "<p>Rows whose residual with the corrected model is far larger than the noise. They remain "
      "in the file and in this report but have little or no weight in the fit.</p>\n";
  if (!table.empty()) html += table.Html();
  if (count > kMaxOutliers) {
    html += fmt::format("<p>and {} more.</p>\n", count - kMaxOutliers);
  }
  return html;
}

std::string MeasuredText(const Diagnosis& diagnosis, const CertificateDetails& details) {
  const auto times = std::ranges::find(diagnosis.signals, "t_s", &SignalTrace::name);
  if (!diagnosis.domain.time_zero_s || times == diagnosis.signals.end()) return details.measured_on;
  double first_s = kNever_s, last_s = -kNever_s;
  for (const double at_s : times->values) {
    if (!std::isfinite(at_s)) continue;
    first_s = std::min(first_s, at_s);
    last_s = std::max(last_s, at_s);
  }
  if (first_s > last_s) return details.measured_on;
  const double zero_s = *diagnosis.domain.time_zero_s;
  const std::string first = UtcInWords(text::TextFromUtc(zero_s + first_s)),
                    last = UtcInWords(text::TextFromUtc(zero_s + last_s));
  const bool one_day = first.substr(0, 10) == last.substr(0, 10);
  return first.substr(0, 16) + " to " + (one_day ? last.substr(11) : last);
}

std::string DataTable(const Diagnosis& diagnosis, const model::CellModel& cell,
                      const ReportSource& source) {
  std::set<std::string> sessions;
  for (const RowTrace& row : diagnosis.rows) sessions.insert(row.session);
  HtmlTable table({"Item", "Value"}, {0, 1});
  table.AddRow({"Cell", Escape(cell.robot.name) + " (" + Escape(source.cell_file) + ")"});
  table.AddRow({"Measured data", Escape(source.data_file)});
  const bool all_count = static_cast<int>(diagnosis.rows.size()) == source.rows;
  table.AddRow(
      {"Rows", fmt::format("{}{}{}", diagnosis.rows.size(),
                           all_count ? std::string() : fmt::format(" of {} lines", source.rows),
                           sessions.size() > 1 ? fmt::format(" in {} sessions", sessions.size())
                                               : std::string())});
  if (!source.unreadable_lines.empty()) {
    std::string lines;
    for (std::size_t k = 0; k < std::min(source.unreadable_lines.size(), kMaxOutliers); ++k) {
      lines += fmt::format("{}{}", k == 0 ? "" : ", ", source.unreadable_lines[k]);
    }
    if (source.unreadable_lines.size() > kMaxOutliers) lines += ", ..";
    table.AddRow({"Lines that could not be read", lines});
  }
  table.AddRow({"Noise, standard deviation of one axis",
                Escape(fmt::format("{} mm, {}", MillimetreText(diagnosis.sigma_m),
                                   OriginText(diagnosis.sigma_origin)))});
  if (!diagnosis.held_out_by.empty()) {
    table.AddRow({"Held out", Escape(diagnosis.held_out_by)});
  }
  const model::Domain& domain = diagnosis.domain;
  if (domain.residual_sigma_m) {
    std::string spread = MillimetreText(*domain.residual_sigma_m) + " mm at the measured poses";
    if (domain.declared_sigma_m) {
      const double most_m = std::hypot(*domain.residual_sigma_m, *domain.declared_sigma_m);
      spread += fmt::format(", up to {} mm far from them, where the correction fades",
                            MillimetreText(most_m));
    } else if (domain.distant_sigma_m) {
      const double away_m = std::hypot(*domain.residual_sigma_m, *domain.distant_sigma_m);
      spread += fmt::format(", {} mm one radian away from them", MillimetreText(away_m));
    }
    table.AddRow({"Expected residual of new points (standard deviation of one axis)", spread});
  }
  const std::string measured = MeasuredText(diagnosis, source.certificate_details);
  table.AddRow({"Measured", measured.empty() ? "not stated" : Escape(measured)});
  table.AddRow({"Report written", Escape(UtcInWords(source.utc))});
  table.AddRow({"Program", "Plumbline " + Escape(source.version)});
  return table.Html();
}

std::string FigureHtml(const PanelGroup& group) {
  if (group.panels.empty()) return "";
  const bool drawn =
      std::ranges::any_of(group.panels, [](const Panel& panel) { return !panel.svg.empty(); });
  if (!drawn) return "";
  const bool small = group.panels.size() > 4 || group.panels.size() == 3;
  std::string html = "<figure>\n<div class=\"panels";
  html += small ? " small\">\n" : "\">\n";
  for (const Panel& panel : group.panels) {
    html += "<div class=\"panel\"><p>" + Escape(panel.title) + "</p>\n" +
            (panel.note.empty() ? "" : "<p class=\"soft\">" + Escape(panel.note) + "</p>\n") +
            panel.svg + "</div>\n";
  }
  html += "</div>\n";
  if (group.colour_to_mm > 0) {
    html += "<div class=\"legend\"><span>0</span><i></i><span>" +
            Escape(MillimetreText(1e-3 * group.colour_to_mm)) + " mm and more</span></div>\n";
  }
  return html + "<figcaption>" + Escape(group.caption) + "</figcaption>\n</figure>\n";
}

}  // namespace plumbline::measure
