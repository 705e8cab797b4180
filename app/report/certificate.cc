#include "app/report/certificate.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <utility>

#include "app/diagnosis/diagnosis_text.h"
#include "app/report/html.h"
#include "firmware-like/geometry/angle.h"
#include "firmware-like/geometry/length.h"

namespace plumbline::report {
namespace {

constexpr std::size_t kMaxNameLength = 32, kMaxSentenceLength = 500, kMaxWordLength = 24,
                      kMaxInstrumentLength = 44, kMaxFileLength = 60;
constexpr std::size_t kMaxItemLength = 64;
constexpr std::size_t kMaxCoefficients = 4, kMaxUntested = 2;

/// The text cut at a character boundary if it is longer than the page permits.
std::string Shortened(const std::string& text, std::size_t most) {
  const std::string valid = ValidUtf8(text);
  if (valid.size() <= most) return valid;
  std::size_t end = most;
  while (end > 0 && (static_cast<unsigned char>(valid[end]) & 0xC0) == 0x80) --end;
  return valid.substr(0, end) + "\u2026";
}

struct VerdictMark {
  const char *word, *glyph, *style;
};

VerdictMark MarkOf(diagnosis::Verdict verdict) {
  switch (verdict) {
    case diagnosis::Verdict::kNoEffect:
      return {"No effect", "\u25cf", "no-effect"};
    case diagnosis::Verdict::kExplained:
      return {"Explained", "\u25cf", "explained"};
    case diagnosis::Verdict::kAmbiguous:
      return {"Ambiguous", "\u25b2", "ambiguous"};
    case diagnosis::Verdict::kUnknown:
      break;
  }
  return {"Unknown cause", "\u25a0", "unknown"};
}

/// The finding that a rival would replace, with its joints.
std::string ReplacedFinding(const diagnosis::Diagnosis& diagnosis, const diagnosis::Rival& rival) {
  for (const diagnosis::Finding& finding : diagnosis.findings) {
    if (finding.effect.term.effect->traits().id != rival.instead_of) continue;
    const std::string name = diagnosis::EffectName(finding);
    if (rival.cycles) return fmt::format("{} ({})", name, diagnosis::ReplacedName(rival));
    const bool variants = rival.id == rival.instead_of && !rival.instead_of_word.empty();
    return variants ? fmt::format("{} ({})", name, rival.instead_of_word) : name;
  }
  return diagnosis::ReplacedName(rival);
}

/// "q1 -103.81, q2 -81.92 deg": the joints of a pose.
std::string PoseText(const diagnosis::NextPose& pose, const model::CellModel& cell) {
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
std::string VerdictSentence(const diagnosis::Diagnosis& diagnosis, const model::CellModel& cell) {
  const bool rivals = diagnosis.verdict == diagnosis::Verdict::kAmbiguous &&
                      !diagnosis.rivals.empty() && diagnosis.rival_drivers.empty();
  if (!rivals) return diagnosis::Capitalized(diagnosis::Headline(diagnosis)) + ".";
  const diagnosis::Rival& rival = diagnosis.rivals.front();
  std::string text = fmt::format("Either {} or {}: these rows cannot separate them; ",
                                 ReplacedFinding(diagnosis, rival), diagnosis::RivalName(rival));
  if (diagnosis.next_poses.empty()) {
    text += "no pose near those measured was found that would.";
  } else {
    const diagnosis::NextPose& pose = diagnosis.next_poses.front();
    text += fmt::format("measure {} with {:.1f} kg, where the explanations differ by {} mm.",
                        PoseText(pose, cell), pose.payload_kg,
                        diagnosis::MillimetreText(pose.separation_m));
  }
  const std::size_t more = diagnosis.rivals.size() - 1;
  if (more > 0) {
    text += fmt::format(" {} further explanation{} in the appendix.", more,
                        more == 1 ? " is" : "s are");
  }
  return text;
}

std::string CountText(std::size_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

/// "all 4 checks passed, but 2 effects are in doubt", or empty.
std::string ChecksText(const diagnosis::Diagnosis& diagnosis) {
  const std::size_t all = diagnosis.checks.size();
  const auto passed =
      static_cast<std::size_t>(std::count_if(diagnosis.checks.begin(), diagnosis.checks.end(),
                                             [](const auto& check) { return check.passed; }));
  std::set<std::pair<std::string, std::vector<std::string>>> doubtful;
  for (const diagnosis::Doubt& doubt : diagnosis.doubts) doubtful.emplace(doubt.id, doubt.scope);
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
std::string RestsOn(const diagnosis::Diagnosis& diagnosis) {
  std::set<std::string> sessions;
  for (const diagnosis::RowTrace& row : diagnosis.rows) sessions.insert(row.session);
  std::string text = "Rests on " + CountText(diagnosis.rows.size(), "row");
  if (sessions.size() > 1) text += fmt::format(" in {} sessions", sessions.size());
  if (!diagnosis.outlier_rows.empty()) {
    text += fmt::format(" ({} rejected)", diagnosis.outlier_rows.size());
  }
  if (const std::string checks = ChecksText(diagnosis); !checks.empty()) text += "; " + checks;
  const std::string error = diagnosis::ErrorSentence(diagnosis);
  text += error.empty() ? fmt::format("; residual {} mm RMS",
                                      diagnosis::MillimetreText(diagnosis.rms_before_m))
                        : "; residual " + error;
  if (const auto arrow = text.find(" -> "); arrow != std::string::npos) {
    text.replace(arrow, 4, " \u2192 ");
  }
  return text + fmt::format("; noise floor {} mm, {}.",
                            diagnosis::MillimetreText(diagnosis.noise_floor_m),
                            diagnosis::OriginText(diagnosis.noise_floor_origin));
}

/// Reservations: why a correction was withheld, doubts, failed checks.
std::vector<std::string> Reservations(const diagnosis::Diagnosis& diagnosis) {
  std::vector<std::string> lines;
  if (!diagnosis.withheld.empty()) lines.push_back("No correction: " + diagnosis.withheld);
  for (const diagnosis::ExplanationCheck& check : diagnosis.checks) {
    if (check.effect.empty() && !check.passed) lines.push_back("Not explained: " + check.sentence);
  }
  for (const diagnosis::Doubt& doubt : diagnosis.doubts) {
    lines.push_back("In doubt: " + diagnosis::EffectName(doubt.id, doubt.scope) + ": " +
                    doubt.reason);
  }
  for (const diagnosis::Finding& finding : diagnosis.findings) {
    if (finding.implausible.empty()) continue;
    lines.push_back("Implausible: " + diagnosis::EffectName(finding) + ": " + finding.implausible);
  }
  return lines;
}

std::string Banner(const diagnosis::Diagnosis& diagnosis, const model::CellModel& cell) {
  const VerdictMark mark = MarkOf(diagnosis.verdict);
  std::string html = fmt::format(
      "<div class=\"banner {}\">\n<p class=\"word\">{} {}</p>\n<p class=\"headline\">{}</p>\n",
      mark.style, mark.glyph, mark.word,
      Escape(Shortened(VerdictSentence(diagnosis, cell), kMaxSentenceLength)));
  html += "<p>" + Escape(Shortened(RestsOn(diagnosis), kMaxSentenceLength)) + "</p>\n";
  const std::vector<std::string> reservations = Reservations(diagnosis);
  if (!reservations.empty()) {
    html += "<p>" + Escape(Shortened(reservations.front(), kMaxSentenceLength / 2));
    if (reservations.size() > 1) {
      html += fmt::format(" {} more in the appendix.",
                          CountText(reservations.size() - 1, "reservation"));
    }
    html += "</p>\n";
  }
  return html + "</div>\n";
}

std::string ConformityBlock(const CertificateInput& input) {
  const std::optional<double>& tolerance_m = input.source.certificate_details.tolerance_m;
  if (!tolerance_m) {
    return "<p class=\"conformity\">No tolerance was stated (--tolerance-mm): this page makes no "
           "statement of conformity.</p>\n";
  }
  const Conformity conformity = ConformityOf(input.achieved, *tolerance_m);
  const char* style = "not-decided";
  const char* glyph = "\u25b2";
  if (conformity.outcome == Conformity::Outcome::kConforms) {
    style = "conforms";
    glyph = "\u2713";
  } else if (conformity.outcome == Conformity::Outcome::kDoesNotConform) {
    style = "fails";
    glyph = "\u25a0";
  }
  return fmt::format(
      "<p class=\"conformity {}\"><b>{} {}</b> Decision rule of ISO 14253-1: |error| + U &le; "
      "tolerance.</p>\n",
      style, glyph, Escape(conformity.sentence));
}

/// A text, or a line to be filled in by hand.
std::string OrBlank(const std::string& text, std::size_t most = kMaxWordLength) {
  return text.empty() ? std::string("<span class=\"blank\">&nbsp;</span>")
                      : Escape(Shortened(text, most));
}

std::string RangeText(const model::Interval& range, const char* unit) {
  if (range.low == range.high) return fmt::format("{:.3g} {}", range.low, unit);
  return fmt::format("{:.3g} to {:.3g} {}", range.low, range.high, unit);
}

std::string Particular(const char* name, const std::string& html) {
  return fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", name, html);
}

std::string ParticularsTable(const CertificateInput& input) {
  const ReportSource& source = input.source;
  const model::Domain& domain = input.diagnosis.domain;
  const model::Measurement& measurement = input.cell.measurement;
  std::string html = "<table class=\"particulars\"><tbody>\n";
  html += Particular("Measured", Escape(Shortened(source.data_file, kMaxWordLength)));
  if (input.achieved.before) {
    html += Particular("Poses, rows",
                       fmt::format("{}, {}", input.achieved.before->characteristics.poses.size(),
                                   input.achieved.rows));
  }
  html += Particular("Instrument",
                     OrBlank(source.certificate_details.instrument, kMaxInstrumentLength));
  html += Particular("Serial number", OrBlank(source.certificate_details.serial));
  html += Particular("Its uncertainty",
                     measurement.sigma_m
                         ? Escape("\u03c3 = " + diagnosis::MillimetreText(*measurement.sigma_m) +
                                  " mm per axis, declared")
                         : std::string("not declared"));
  std::string temperature =
      domain.temp_C ? RangeText(*domain.temp_C, "\u00b0C") : std::string("not recorded");
  if (measurement.reference_temperature_C) {
    temperature += fmt::format(", reference {:.3g} \u00b0C", *measurement.reference_temperature_C);
  }
  html += Particular("Temperature", Escape(temperature));
  html += Particular("Payload", domain.payload_kg ? Escape(RangeText(*domain.payload_kg, "kg"))
                                                  : std::string("not recorded"));
  std::string model = source.declared_fingerprint.empty() ? "unknown" : source.declared_fingerprint;
  html += Particular("Model, declared", Escape(model));
  html += Particular("Model, corrected", source.corrected_fingerprint.empty()
                                             ? std::string("not written")
                                             : Escape(source.corrected_fingerprint));
  return html + "</tbody></table>\n";
}

std::string CoefficientsTable(const diagnosis::Diagnosis& diagnosis) {
  if (diagnosis.findings.empty()) return "";
  HtmlTable table({"Change to the model", "Parameter", "Value &plusmn; U (k = 2)", "Unit",
                   "Share of the residual"},
                  {0, 1, 3});
  std::size_t count = 0;
  std::string trends;
  for (const diagnosis::Finding& finding : diagnosis.findings) {
    const std::string line = diagnosis::LinearTrendText(finding.effect);
    if (!line.empty() && trends.empty()) trends = diagnosis::Capitalized(line) + ".";
    const model::WrittenEffect written =
        effects::WrittenFromActive(finding.effect, finding.covariance);
    for (const model::EffectParameter& parameter : written.parameters) {
      if (++count > kMaxCoefficients) continue;
      std::string value = Escape(parameter.word);
      if (parameter.word.empty()) {
        const auto twice = parameter.sd ? std::optional(2 * *parameter.sd) : std::nullopt;
        const diagnosis::ValueText shown = diagnosis::ValueTextOf(parameter.value, twice);
        value =
            NumberHtml(shown.value) + (shown.sd.empty() ? "" : " &plusmn; " + NumberHtml(shown.sd));
      }
      table.AddRow({Escape(Shortened(diagnosis::Capitalized(diagnosis::EffectName(written.id)),
                                     kMaxWordLength)),
                    Escape(Shortened(parameter.name, kMaxWordLength)), value,
                    Escape(parameter.unit == "1" ? "" : parameter.unit),
                    Escape(diagnosis::PercentText(finding.share_of_residual))});
    }
  }
  std::string note = trends;
  if (count > kMaxCoefficients) {
    note += fmt::format("{}{} in the appendix.", note.empty() ? "" : " ",
                        CountText(count - kMaxCoefficients, "more parameter"));
  }
  if (!diagnosis.withheld.empty()) note = "Not written to the model. " + note;
  return table.Html() +
         (note.empty()
              ? ""
              : "<p class=\"soft\">" + Escape(Shortened(note, kMaxSentenceLength / 2)) + "</p>\n");
}

std::string NotTested(const CertificateInput& input) {
  std::vector<std::string> items;
  if (input.achieved.before) {
    const accuracy::Characteristics& all = input.achieved.before->characteristics;
    const auto fewest =
        std::min_element(all.poses.begin(), all.poses.end(),
                         [](const auto& a, const auto& b) { return a.cycles < b.cycles; });
    if (fewest->cycles < 30) items.emplace_back("30 cycles at every pose (ISO 9283)");
  }
  const auto& missing = input.diagnosis.not_recorded;
  for (std::size_t k = 0; k < std::min(missing.size(), kMaxUntested); ++k) {
    items.push_back(Shortened(missing[k], kMaxItemLength));
  }
  if (missing.size() > kMaxUntested) {
    items.push_back(fmt::format("{} more in the appendix", missing.size() - kMaxUntested));
  }
  items.emplace_back("poses, payloads and temperatures beyond those measured");
  return "<p class=\"soft\"><b>Not tested:</b> " +
         Escape(fmt::format("{}", fmt::join(items, "; "))) + ".</p>\n";
}

std::string CertificateFigureHtml(const CertificateFigure& figure, const char* style) {
  if (figure.panel.svg.empty()) return "";
  return fmt::format("<div class=\"plot {}\"><p><b>{}.</b> {}</p>\n{}</div>\n", style,
                     Escape(figure.panel.title),
                     Escape(Shortened(figure.sentence, kMaxSentenceLength)), figure.panel.svg);
}

std::string Approval(const ReportSource& source) {
  std::string html =
      "<table class=\"approval\"><tbody><tr><td>Approved by<br>" +
      OrBlank(source.certificate_details.approved_by) +
      "</td><td>Date<br><span class=\"blank\">&nbsp;</span></td><td>Signature<br>"
      "<span class=\"blank\">&nbsp;</span></td></tr></tbody></table>\n<p class=\"digest\">SHA-256 ";
  const auto digest = [](const std::string& file, const std::string& hex) {
    return Escape(Shortened(file, kMaxFileLength)) + " " + (hex.empty() ? "not computed" : hex);
  };
  return html + digest(source.data_file, source.data_sha256) + "<br>SHA-256 " +
         digest(source.cell_file, source.cell_sha256) + "</p>\n";
}

}  // namespace

std::string CertificatePage(const CertificateInput& input) {
  const ReportSource& source = input.source;
  std::string html =
      "<section class=\"certificate\">\n<header>\n<table class=\"title\"><tbody><tr><td><h1>" +
      Escape(Shortened(input.cell.robot.name, kMaxNameLength)) +
      "</h1><p>Accuracy certificate: diagnosis of " +
      CountText(input.diagnosis.rows.size(), "measured point") + "</p></td><td class=\"when\">" +
      Escape(source.utc.empty() ? source.date : source.utc) + "<br>Plumbline " +
      Escape(source.version) + "</td></tr></tbody></table>\n</header>\n";
  html += Banner(input.diagnosis, input.cell);
  html += ConformityBlock(input);
  const std::string points = CertificateFigureHtml(input.points, "points"),
                    deciding = CertificateFigureHtml(input.deciding, "deciding");
  if (!input.figure_fault.empty()) {
    html += "<p class=\"note\">This report has no figures: " +
            Escape(Shortened(input.figure_fault, kMaxSentenceLength)) +
            ". Fix this and run the diagnosis again with --report.</p>\n";
  }
  // The plot that gives an unknown cause away comes first.
  const bool first = input.diagnosis.verdict == diagnosis::Verdict::kUnknown;
  if (first) html += deciding;
  html += "<table class=\"columns\"><tbody><tr><td class=\"left\">\n" +
          CharacteristicsTable(input.achieved);
  if (input.achieved.before) {
    html += std::string("<p class=\"soft\">&plusmn; U = k u<sub>c</sub>, coverage 95.45 %; ") +
            (input.achieved.held_out ? "errors of held-out rows" : "errors of the fitted rows") +
            ".</p>\n";
  }
  html += "</td><td>\n" + ParticularsTable(input) + "</td></tr></tbody></table>\n";
  html += points;
  if (!first) html += deciding;
  html += CoefficientsTable(input.diagnosis) + NotTested(input) + Approval(source);
  return html + "</section>\n";
}

}  // namespace plumbline::report
