#include "app/measure/report/certificate_verdict.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include "app/measure/diagnosis/diagnosis_text.h"
#include "app/measure/diagnosis/headline.h"
#include "app/measure/report/certificate_text.h"
#include "app/measure/report/html.h"
#include "firmware-like/geometry/angle.h"
#include "firmware-like/geometry/length.h"

namespace plumbline::measure {
namespace {

struct VerdictMark {
  const char *word, *glyph, *style;
};

VerdictMark MarkOf(Verdict verdict) {
  switch (verdict) {
    case Verdict::kNoEffect:
      return {"No effect", "\u25cf", "no-effect"};
    case Verdict::kExplained:
      return {"Explained", "\u25cf", "explained"};
    case Verdict::kAmbiguous:
      return {"Ambiguous", "\u25b2", "ambiguous"};
    case Verdict::kUnknown:
      break;
  }
  return {"Unknown cause", "\u25a0", "unknown"};
}

/// The finding that a rival would replace, with its joints.
std::string ReplacedFinding(const Diagnosis& diagnosis, const Rival& rival) {
  for (const Finding& finding : diagnosis.findings) {
    if (finding.effect.term.effect->traits().id != rival.instead_of) continue;
    const std::string name = EffectName(finding);
    if (rival.cycles) return fmt::format("{} ({})", name, ReplacedName(rival));
    const bool variants = rival.id == rival.instead_of && !rival.instead_of_word.empty();
    return variants ? fmt::format("{} ({})", name, rival.instead_of_word) : name;
  }
  return ReplacedName(rival);
}

/// "q1 -103.81, q2 -81.92 deg": the joints of a pose.
std::string PoseText(const NextPose& pose, const model::CellModel& cell) {
  std::string text;
  for (Eigen::Index i = 0; i < pose.q.size(); ++i) {
    const auto joint = static_cast<std::size_t>(i);
    const bool linear = joint < cell.robot.joints.size() &&
                        cell.robot.joints[joint].type == model::JointType::kPrismatic;
    text += fmt::format("{}q{} {:.1f}{}", i == 0 ? "" : ", ", i + 1,
                        pose.q[i] * (linear ? kMmPerMetre : kDegPerRad), linear ? " mm" : "\u00b0");
  }
  return text;
}

/// The verdict in one sentence; if rivals remain, which two and what to measure.
std::string VerdictSentence(const Diagnosis& diagnosis, const model::CellModel& cell) {
  const bool rivals = diagnosis.verdict == Verdict::kAmbiguous && !diagnosis.rivals.empty() &&
                      diagnosis.rival_drivers.empty();
  if (!rivals) return Capitalized(Headline(diagnosis)) + ".";
  const Rival& rival = diagnosis.rivals.front();
  std::string text = fmt::format("Either {} or {}: these rows cannot separate them; ",
                                 ReplacedFinding(diagnosis, rival), RivalName(rival));
  if (diagnosis.next_poses.empty()) {
    text += "no pose near those measured was found that would.";
  } else {
    const NextPose& pose = diagnosis.next_poses.front();
    text += fmt::format("measure {} with {:.1f} kg, where the explanations differ by {} mm.",
                        PoseText(pose, cell), pose.payload_kg, MillimetreText(pose.separation_m));
  }
  const std::size_t more = diagnosis.rivals.size() - 1;
  if (more > 0) {
    text += fmt::format(" {} further explanation{} in the appendix.", more,
                        more == 1 ? " is" : "s are");
  }
  return text;
}

/// "all 4 checks passed, but 2 effects are in doubt", or empty.
std::string ChecksText(const Diagnosis& diagnosis) {
  const std::size_t all = diagnosis.checks.size();
  const auto passed =
      static_cast<std::size_t>(std::count_if(diagnosis.checks.begin(), diagnosis.checks.end(),
                                             [](const auto& check) { return check.passed; }));
  std::set<std::pair<std::string, std::vector<std::string>>> doubtful;
  for (const Doubt& doubt : diagnosis.doubts) doubtful.emplace(doubt.id, doubt.scope);
  std::string text;
  if (all == 1) {
    text = passed == 1 ? "the one check passed" : "the one check failed";
  } else if (all > 1) {
    text = passed == all ? fmt::format("all {} checks passed", all)
                         : fmt::format("{} of {} checks passed", passed, all);
  }
  if (doubtful.empty()) return text;
  const char* const link = text.empty() ? "" : passed == all ? ", but " : ", and ";
  return text + link + CountText(doubtful.size(), "effect") +
         (doubtful.size() == 1 ? " is in doubt" : " are in doubt");
}

/// What the verdict rests on: rows, checks, errors against the noise.
std::string RestsOn(const Diagnosis& diagnosis) {
  std::set<std::string> sessions;
  for (const RowTrace& row : diagnosis.rows) sessions.insert(row.session);
  std::string text = "Rests on " + CountText(diagnosis.rows.size(), "row");
  if (sessions.size() > 1) text += fmt::format(" in {} sessions", sessions.size());
  if (!diagnosis.outlier_rows.empty()) {
    text += fmt::format(" ({} rejected)", diagnosis.outlier_rows.size());
  }
  if (const std::string checks = ChecksText(diagnosis); !checks.empty()) text += "; " + checks;
  const std::string error = ErrorSentence(diagnosis);
  text += error.empty()
              ? fmt::format("; residual {} mm RMS", MillimetreText(diagnosis.rms_before_m))
              : "; residual " + error;
  if (const auto arrow = text.find(" -> "); arrow != std::string::npos) {
    text.replace(arrow, 4, " \u2192 ");
  }
  return text + fmt::format("; noise floor {} mm, {}.", MillimetreText(diagnosis.noise_floor_m),
                            OriginText(diagnosis.noise_floor_origin));
}

/// Reservations: why a correction was withheld, doubts, failed checks.
std::vector<std::string> Reservations(const Diagnosis& diagnosis) {
  std::vector<std::string> lines;
  if (!diagnosis.withheld.empty()) lines.push_back("No correction: " + diagnosis.withheld);
  for (const ExplanationCheck& check : diagnosis.checks) {
    if (check.effect.empty() && !check.passed) lines.push_back("Not explained: " + check.sentence);
  }
  for (const Doubt& doubt : diagnosis.doubts) {
    lines.push_back("In doubt: " + EffectName(doubt.id, doubt.scope) + ": " + doubt.reason);
  }
  for (const Finding& finding : diagnosis.findings) {
    if (finding.implausible.empty()) continue;
    lines.push_back("Implausible: " + EffectName(finding) + ": " + finding.implausible);
  }
  return lines;
}

}  // namespace

std::string VerdictBanner(const Diagnosis& diagnosis, const model::CellModel& cell) {
  const VerdictMark mark = MarkOf(diagnosis.verdict);
  std::string html = fmt::format(
      "<div class=\"banner {}\">\n<p class=\"word\">{} {}</p>\n<p class=\"headline\">{}</p>\n",
      mark.style, mark.glyph, mark.word,
      Escape(Shortened(VerdictSentence(diagnosis, cell), kMaxSentenceLength)));
  html += "<p>" + Escape(Shortened(RestsOn(diagnosis), kMaxSentenceLength)) + "</p>\n";
  const std::vector<std::string> reservations = Reservations(diagnosis);
  if (!reservations.empty()) {
    const std::string first = Shortened(reservations.front(), kMaxSentenceLength / 2);
    const bool ends = first.ends_with('.') || first.ends_with("…");
    html += "<p>" + Escape(first) + (ends ? "" : ".");
    if (reservations.size() > 1) {
      html += fmt::format(" {} more in the appendix.",
                          CountText(reservations.size() - 1, "reservation"));
    }
    html += "</p>\n";
  }
  return html + "</div>\n";
}

}  // namespace plumbline::measure
