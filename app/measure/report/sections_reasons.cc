// Report sections on the evidence: candidates, rivals, proposed poses, outliers, data.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "app/base/text/text.h"
#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "app/measure/report/html.h"
#include "app/measure/report/sections.h"
#include "app/measure/report/signal_bins.h"
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

/// "selected", or the gap; empty if no explanation contains the effect and none was cut off.
std::string GapText(const CandidateOutcome& one) {
  if (one.taken) return "selected";
  const double gap = one.evidence_gap;
  if (!Offered(one) || (gap == 0 && one.parameters == 0)) return "";
  return (one.gap_is_lower_bound ? "&gt; " : "") +
         NumberHtml(fmt::format("{:.{}f}", gap, std::abs(gap) < 10 ? 1 : 0));
}

/// Selected effects first, then by evidence; those without a gap last.
bool Before(const CandidateOutcome& a, const CandidateOutcome& b) {
  const auto rank = [](const CandidateOutcome& one) {
    return std::tuple(!one.taken, GapText(one).empty(), one.evidence_gap);
  };
  return rank(a) < rank(b);
}

}  // namespace

std::string ConsideredTable(const Diagnosis& diagnosis) {
  if (diagnosis.considered.empty()) return "";
  std::vector<CandidateOutcome> all = diagnosis.considered;
  std::ranges::stable_sort(all, &Before);
  const auto& limits_m = diagnosis.minimum_detectable_m;
  HtmlTable table({"Effect", "Alone", "Gap", "Detectable (mm)"}, {0});
  std::map<std::string, std::string> left_out;  // effects by reason
  for (const CandidateOutcome& one : all) {
    const std::string name = EffectName(one.id, one.taken ? one.scope : std::vector<std::string>());
    const auto limit = limits_m.find(one.id);
    if (!Offered(one) && limit == limits_m.end()) {
      std::string& names = left_out[InWords(one.reason, diagnosis)];
      names += (names.empty() ? "" : ", ") + name;
      continue;
    }
    table.AddRow({Escape(Capitalized(name)), Escape(PercentText(one.signal_share)), GapText(one),
                  limit == limits_m.end() ? "" : Escape(MillimetreText(limit->second))},
                 one.taken);
  }
  std::string not_considered;
  for (const auto& [reason, names] : left_out)
    not_considered += fmt::format("{}{} ({})", not_considered.empty() ? "" : "; ", names, reason);
  return table.HtmlAcross(2) +
         "<p class=\"soft\">Alone: share of the residual, after alignment of the frames, that this "
         "effect explains as the only one. Gap: score of the best explanation that contains the "
         "effect minus the best score overall; 16 (four standard deviations) rules the effect out, "
         "and without a gap it explains nothing beyond the noise. Detectable: RMS of the effect's "
         "displacement over these rows that would have been detected with a probability of 90 "
         "%.</p>\n" +
         (not_considered.empty()
              ? ""
              : "<p class=\"soft\">Not considered: " + Escape(not_considered) + ".</p>\n");
}

std::string SignalsTable(const Diagnosis& diagnosis) {
  if (diagnosis.signals.empty()) return "";
  HtmlTable table({"Signal", "Axis", "Before", "After", "p"}, {0, 1});
  for (const Dependence& on : DependencesOf(diagnosis)) {
    table.AddRow(
        {Escape(Capitalized(ColumnInWords(on.signal->name))), std::string(1, "xyz"[on.axis]),
         Escape(PercentText(on.share_before)), Escape(PercentText(on.share_after)),
         on.signal->p_value < 0.001 ? "&lt;0.001" : fmt::format("{:.2g}", on.signal->p_value)});
  }
  return table.HtmlAcross(2);
}

std::string RivalsTable(const Diagnosis& diagnosis) {
  if (diagnosis.rivals.empty()) return "";
  HtmlTable table({"Explanation", "In place of", "Reproduces", "Score difference",
                   "Difference, RMS (mm)", "Largest (mm)"},
                  {0, 1});
  for (const Rival& rival : diagnosis.rivals) {
    double square = 0, largest_m = 0;
    for (const Vec3& shift_m : rival.shift_W) {
      square += shift_m.squaredNorm() / static_cast<double>(rival.shift_W.size());
      largest_m = std::max(largest_m, shift_m.norm());
    }
    const bool compared = !rival.shift_W.empty();
    table.AddRow({Escape(Capitalized(RivalName(rival))), Escape(ReplacedName(rival)),
                  Escape(PercentText(std::max(0.0, 1 - rival.signal_left))),
                  NumberHtml(fmt::format("{:+.1f}", rival.evidence_gap)),
                  compared ? Escape(MillimetreText(std::sqrt(square))) : "",
                  compared ? Escape(MillimetreText(largest_m)) : ""});
  }
  return table.Html() +
         fmt::format(
             "<p class=\"soft\">Reproduces: share of the displacement at these points that "
             "the explanation reproduces after refitting. Difference: between its "
             "predictions and those of the selected one; the noise floor is {} mm.</p>\n",
             Escape(MillimetreText(diagnosis.noise_floor_m)));
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

std::string RemarksList(const Diagnosis& diagnosis) {
  const std::vector<std::string> reservations = Reservations(diagnosis);
  std::vector<std::string> remarks;
  for (const std::string& note : diagnosis.notes) {
    const std::string remark = InWords(note, diagnosis);
    if (std::ranges::none_of(reservations,
                             [&](const std::string& line) { return line.ends_with(remark); })) {
      remarks.push_back(remark);
    }
  }
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
  if (!table.empty()) html += table.HtmlAcross(3);
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

std::string DataTable(const Diagnosis& diagnosis, const ReportSource& source) {
  std::set<std::string> sessions;
  for (const RowTrace& row : diagnosis.rows) sessions.insert(row.session);
  HtmlTable table({"Item", "Value"}, {0, 1});
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
  if (!diagnosis.not_recorded.empty()) {
    table.AddRow(
        {"Not recorded",
         Escape(InWords(fmt::format("{}", fmt::join(diagnosis.not_recorded, "; ")), diagnosis))});
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
  return table.Html();
}

std::string FigureHtml(const PanelGroup& group) {
  if (group.panels.empty()) return "";
  const bool drawn =
      std::ranges::any_of(group.panels, [](const Panel& panel) { return !panel.svg.empty(); });
  if (!drawn) return "";
  std::string html = fmt::format("<figure>\n<div class=\"panels across{}\">\n", group.across);
  for (const Panel& panel : group.panels) {
    html += "<div class=\"panel\"><p>" + Escape(panel.title) + "</p>\n" +
            (panel.note.empty() ? "" : "<p class=\"soft\">" + Escape(panel.note) + "</p>\n") +
            panel.svg + "</div>\n";
  }
  html += "</div>\n";
  if (!group.colour_end.empty()) {
    html += "<div class=\"legend\"><span>0</span><i></i><span>" + Escape(group.colour_end) +
            "</span></div>\n";
  }
  return html + "<figcaption>" + Escape(group.caption) + "</figcaption>\n</figure>\n";
}

}  // namespace plumbline::measure
