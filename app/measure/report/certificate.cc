#include "app/measure/report/certificate.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "app/measure/diagnosis/diagnosis.h"
#include "app/measure/diagnosis/diagnosis_text.h"
#include "app/measure/diagnosis/empirical_curve.h"
#include "app/measure/diagnosis/headline.h"
#include "app/measure/report/certificate_layout.h"
#include "app/measure/report/html.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::measure {
namespace {

// Texts of the certificate: limited in length, so that the page stays one page.

constexpr std::size_t kMaxSentenceLength = 440;

/// The text cut at a character boundary if it is longer than the page permits.
std::string Shortened(const std::string& text, std::size_t most) {
  std::string valid = ValidUtf8(text);
  std::size_t characters = 0;
  for (std::size_t at = 0; at < valid.size(); ++at) {
    const bool starts = (static_cast<unsigned char>(valid[at]) & 0xC0) != 0x80;
    if (starts && ++characters > most) return valid.substr(0, at) + "\u2026";
  }
  return valid;
}

/// "1 reservation", "2 reservations".
std::string CountText(std::size_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

// Verdict on the first page of the report: what was found, what it rests on, and reservations.

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
  const auto passed = static_cast<std::size_t>(
      std::ranges::count_if(diagnosis.checks, [](const auto& check) { return check.passed; }));
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

/// HTML; of several reservations, the first and the number of the others.
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

constexpr std::size_t kMaxNameLength = 48, kMaxWordLength = 24, kMaxParticularLength = 44,
                      kMaxSerialLength = 44, kMaxApproverLength = 32, kMaxFileLength = 60;
constexpr std::size_t kMaxItemLength = 64;
constexpr std::size_t kMaxCoefficients = 4, kMaxUntested = 2;
constexpr double kAllShares = 1.02, kMostShares = 0.85;

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
std::string OrBlank(const std::string& text, std::size_t most = kMaxParticularLength) {
  return text.empty() ? std::string("<span class=\"blank\">&nbsp;</span>")
                      : Escape(Shortened(text, most));
}

std::string RangeText(const model::Interval& range, const char* unit) {
  // Both ends to the same digit.
  const auto whole = [](double value) { return std::abs(value - std::round(value)) < 0.05; };
  const int digits = whole(range.low) && whole(range.high) ? 0 : 1;
  if (range.low == range.high) return fmt::format("{:.{}f} {}", range.low, digits, unit);
  return fmt::format("{:.{}f} to {:.{}f} {}", range.low, digits, range.high, digits, unit);
}

std::string Particular(const char* name, const std::string& html) {
  return fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", name, html);
}

std::string ParticularsTable(const CertificateInput& input) {
  const ReportSource& source = input.source;
  const model::Domain& domain = input.diagnosis.domain;
  const model::Measurement& measurement = input.cell.measurement;
  const std::optional<double>& of_rows_m = input.diagnosis.row_sigma_m;
  const std::optional<double>& sigma_m = of_rows_m ? of_rows_m : measurement.sigma_m;
  std::string html = "<table class=\"particulars\"><tbody>\n";
  html += Particular("Measured", Escape(Shortened(source.data_file, kMaxWordLength)));
  if (input.achieved.before) {
    html += Particular("Poses, rows",
                       fmt::format("{}, {}", input.achieved.before->characteristics.poses.size(),
                                   input.achieved.rows));
  }
  html += Particular("Instrument", OrBlank(source.certificate_details.instrument));
  html += Particular("Serial number", OrBlank(source.certificate_details.serial, kMaxSerialLength));
  html += Particular("Its uncertainty",
                     sigma_m ? Escape("\u03c3 = " + MillimetreText(*sigma_m) + " mm per axis, " +
                                      (of_rows_m ? "median of the rows" : "declared"))
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

/// "(3.34 ± 0.06) × 10^-7": with one power of ten for both numbers, if the value has one.
std::string WithUncertainty(const ValueText& shown) {
  std::string value = NumberHtml(shown.value);
  if (shown.sd.empty()) return value;
  const auto power = shown.value.find('e'), dot = shown.value.find('.');
  if (power == std::string::npos) return value + " &plusmn; " + NumberHtml(shown.sd);
  const std::string mantissa = NumberHtml(shown.value.substr(0, power));
  const double scale = std::pow(10.0, std::stoi(shown.value.substr(power + 1)));
  const auto digits = dot < power ? power - dot - 1 : 0;
  return fmt::format("({} &plusmn; {:.{}f}){}", mantissa, std::stod(shown.sd) / scale, digits,
                     value.substr(mantissa.size()));
}

/// Value with its expanded uncertainty, a word, or the range of an empirical curve, and its unit.
std::pair<std::string, std::string> ValueAndUnit(const model::EffectParameter& parameter,
                                                 const EmpiricalCurve* curve) {
  if (curve != nullptr) return {Escape(curve->range), Escape(curve->unit)};
  const std::string shown_unit = ShownUnitOf(parameter).unit;
  const std::string unit = Escape(shown_unit == "1" ? "" : shown_unit);
  if (!parameter.word.empty()) return {Escape(parameter.word), unit};
  const ValueText shown = ShownValueOf(parameter, 2);
  return {WithUncertainty(shown), unit};
}

/// RMS displacement by one value of the effect [mm], empty for a shape.
std::string AtTheTip(const Finding& finding, std::size_t value) {
  const bool known =
      value < finding.tip_rms_of_each_m.size() && finding.tip_rms_of_each_m[value] > 0;
  return known ? Escape(MillimetreText(finding.tip_rms_of_each_m[value])) : "";
}

/// Adds the rows of an effect's parameters as far as the page has room for them.
/// @param count  number of parameters so far, of which at most kMaxCoefficients have rows
void AddCoefficients(const Finding& finding, HtmlTable& table, std::size_t& count) {
  const model::WrittenEffect written =
      effects::WrittenFromActive(finding.effect, finding.covariance);
  const std::vector<EmpiricalCurve> curves = EmpiricalCurvesOf(finding.effect);
  for (std::size_t k = 0; k < written.parameters.size(); ++k) {
    const model::EffectParameter& parameter = written.parameters[k];
    if (++count > kMaxCoefficients) continue;
    const auto [value, unit] = ValueAndUnit(parameter, k < curves.size() ? &curves[k] : nullptr);
    table.AddRow({Escape(Shortened(Capitalized(EffectName(written.id)), kMaxWordLength)),
                  Escape(Shortened(parameter.name, kMaxWordLength)), value, unit,
                  AtTheTip(finding, k), Escape(PercentText(finding.share_of_residual))});
  }
}

std::string CoefficientsTable(const Diagnosis& diagnosis) {
  if (diagnosis.findings.empty()) return "";
  HtmlTable table({"Change to the model", "Parameter", "Value &plusmn; U (k = 2)", "Unit",
                   "At the tip (mm)", "Share of the residual"},
                  {0, 1, 3});
  std::size_t count = 0;
  double shares = 0;
  std::string trend;
  for (const Finding& finding : diagnosis.findings) {
    shares += finding.share_of_residual;
    if (trend.empty()) trend = Capitalized(LinearTrendText(finding.effect));
    AddCoefficients(finding, table, count);
  }
  std::vector<std::string> notes;
  if (!diagnosis.withheld.empty()) notes.emplace_back("Not written to the model.");
  const bool displaces = std::ranges::any_of(
      diagnosis.findings, [](const Finding& finding) { return finding.tip_rms_m > 0; });
  if (displaces) {
    notes.emplace_back("At the tip: RMS displacement at the measured poses by this value alone.");
  }
  if (!trend.empty()) notes.push_back(trend + ".");
  if (count > kMaxCoefficients) {
    notes.push_back(CountText(count - kMaxCoefficients, "more parameter") + " in the appendix.");
  }
  if (shares > kAllShares) {
    notes.emplace_back(
        "Share: what comes back without that effect; effects that act alike add up to more than "
        "100 %.");
  } else if (shares < kMostShares) {
    notes.emplace_back(
        "Share: what comes back without that effect and the others do not replace; effects that "
        "act alike add up to less than 100 %.");
  }
  if (notes.empty()) return table.Html();
  return table.Html() + "<p class=\"soft\">" +
         Escape(Shortened(fmt::format("{}", fmt::join(notes, " ")), kMaxSentenceLength)) + "</p>\n";
}

std::string NotTested(const CertificateInput& input) {
  std::vector<std::string> items;
  if (const std::string fitted = FittedText(input.achieved); !fitted.empty())
    items.push_back(fitted + " (fitted to the measured points)");
  if (input.achieved.before && input.achieved.other_rows > 0) {
    items.push_back("the accuracy at the " +
                    CountText(static_cast<std::size_t>(input.achieved.other_rows), "row") +
                    " that measure no position");
  }
  if (input.achieved.before) {
    const Characteristics& all = input.achieved.before->characteristics;
    const auto fewest = std::ranges::min_element(
        all.poses, [](const auto& a, const auto& b) { return a.cycles < b.cycles; });
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

std::string Approval(const ReportSource& source) {
  std::string html =
      "<table class=\"approval\"><tbody><tr><td>Approved by<br>" +
      OrBlank(source.certificate_details.approved_by, kMaxApproverLength) +
      "</td><td>Date<br><span class=\"blank\">&nbsp;</span></td><td>Signature<br>"
      "<span class=\"blank\">&nbsp;</span></td></tr></tbody></table>\n<p class=\"digest\">SHA-256 ";
  const auto digest = [](const std::string& file, const std::string& hex) {
    return Escape(Shortened(file, kMaxFileLength)) + " " + (hex.empty() ? "not computed" : hex);
  };
  return html + digest(source.data_file, source.data_sha256) + "<br>SHA-256 " +
         digest(source.cell_file, source.cell_sha256) + "</p>\n";
}

/// Caption of a figure.
std::string CaptionHtml(const CertificateFigure& figure) {
  return fmt::format("<p class=\"caption\"><b>{}.</b> {}</p>\n", Escape(figure.panel.title),
                     Escape(Shortened(figure.sentence, kMaxSentenceLength)));
}

std::string CertificateFigureHtml(const CertificateFigure& figure, const char* style) {
  if (figure.panel.svg.empty()) return "";
  return fmt::format("<div class=\"plot {}\">{}{}</div>\n", style, CaptionHtml(figure),
                     figure.panel.svg);
}

/// The page's parts other than its figures, from top to bottom; `left` and `right` are beside each
/// other.
struct CertificateParts {
  std::string top, left, right, bottom;
};

CertificateParts CertificatePartsOf(const CertificateInput& input) {
  const ReportSource& source = input.source;
  CertificateParts parts;
  parts.top = "<header>\n<table class=\"title\"><tbody><tr><td><h1>" +
              Escape(Shortened(input.cell.robot.name, kMaxNameLength)) +
              "</h1><p>Accuracy certificate: diagnosis of " +
              CountText(input.diagnosis.rows.size(), "measured point") +
              "</p></td><td class=\"when\">" +
              Escape(source.utc.empty() ? source.date : source.utc) + "<br>Plumbline " +
              Escape(source.version) + "</td></tr></tbody></table>\n</header>\n";
  parts.top += VerdictBanner(input.diagnosis, input.cell) + ConformityBlock(input);
  if (!input.figure_fault.empty()) {
    parts.top += "<p class=\"note\">This report has no figures: " +
                 Escape(Shortened(input.figure_fault, kMaxSentenceLength)) +
                 ". Fix this and run the diagnosis again with --report.</p>\n";
  }
  parts.left = CharacteristicsTable(input.achieved);
  if (input.achieved.before) {
    parts.left +=
        std::string("<p class=\"soft\">&plusmn; U = k u<sub>c</sub>, coverage 95.45 %; ") +
        (input.achieved.held_out ? "errors of held-out rows" : "errors of the fitted rows");
    if (const std::string fitted = FittedText(input.achieved); !fitted.empty())
      parts.left +=
          Escape("; " + fitted + (fitted.find(" and ") == std::string::npos ? " was" : " were") +
                 " fitted");
    parts.left += ".</p>\n";
  }
  parts.right = ParticularsTable(input);
  parts.bottom = CoefficientsTable(input.diagnosis) + NotTested(input) + Approval(source);
  return parts;
}

}  // namespace

double CertificateTextHeight_mm(const CertificateInput& input) {
  constexpr double kTitle_mm = 1, kAround_mm = 8, kSignature_mm = 4;  // not in paragraphs or rows
  const CertificateParts parts = CertificatePartsOf(input);
  double height_mm = kTitle_mm + kAround_mm + kSignature_mm + PrintedHeight_mm(parts.top) +
                     std::max(PrintedHeight_mm(parts.left), PrintedHeight_mm(parts.right)) +
                     PrintedHeight_mm(parts.bottom);
  for (const CertificateFigure* const figure : {&input.points, &input.deciding}) {
    if (!figure->panel.script.empty()) height_mm += PrintedHeight_mm(CaptionHtml(*figure));
  }
  return height_mm;
}

std::string CertificatePage(const CertificateInput& input) {
  const CertificateParts parts = CertificatePartsOf(input);
  const std::string points = CertificateFigureHtml(input.points, "points"),
                    deciding = CertificateFigureHtml(input.deciding, "deciding");
  // The plot that gives an unknown cause away comes first.
  const bool first = input.diagnosis.verdict == Verdict::kUnknown;
  std::string html = "<section class=\"certificate\">\n" + parts.top;
  if (first) html += deciding;
  html += "<table class=\"columns\"><tbody><tr><td class=\"left\">\n" + parts.left + "</td><td>\n" +
          parts.right + "</td></tr></tbody></table>\n" + points;
  if (!first) html += deciding;
  return html + parts.bottom + "</section>\n";
}

}  // namespace plumbline::measure
