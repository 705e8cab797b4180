#include "app/measure/report/certificate.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "app/measure/diagnosis/output/summary.h"
#include "app/measure/diagnosis/result/diagnosis.h"
#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "app/measure/report/certificate_layout.h"
#include "app/measure/report/html.h"
#include "app/measure/report/sections.h"
#include "app/measure/report/words.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::measure {
namespace {

// Texts of the certificate: limited in length, so that the page stays one page.

constexpr std::size_t kMaxSentenceLength = 300;

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

/// One of the page's two statements: conformity, and the verdict on the causes.
struct Statement {
  const char *word, *glyph, *state;  ///< the state is a class of the style sheet
  std::string sentence;
  std::vector<std::string> reasons;
};

/// @param style  "headline" of the page, or "second"
std::string StatementHtml(const Statement& statement, const char* style) {
  std::string html = fmt::format(
      "<div class=\"{} {}\">\n<p class=\"word\">{} {}</p>\n<p class=\"sentence\">{}</p>\n", style,
      statement.state, statement.glyph, statement.word,
      Escape(Shortened(statement.sentence, kMaxSentenceLength)));
  for (const std::string& reason : statement.reasons)
    html += "<p>" + Escape(Shortened(reason, kMaxSentenceLength)) + "</p>\n";
  return html + "</div>\n";
}

// Verdict: what was found, what it rests on, and reservations.

Statement MarkOf(Verdict verdict) {
  switch (verdict) {
    case Verdict::kNoEffect:
      return {"No effect", "\u25cf", "neutral", "", {}};
    case Verdict::kExplained:
      return {"Explained", "\u25cf", "good", "", {}};
    case Verdict::kAmbiguous:
      return {"Ambiguous", "\u25b2", "caution", "", {}};
    case Verdict::kUnknown:
      break;
  }
  return {"Unknown cause", "\u25a0", "bad", "", {}};
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

/// "joint 1 -103.8°, joint 2 -81.9°": the joints of a pose.
std::string PoseText(const NextPose& pose, const model::CellModel& cell) {
  std::string text;
  for (Eigen::Index i = 0; i < pose.q.size(); ++i) {
    const auto joint = static_cast<std::size_t>(i);
    const bool linear = joint < cell.robot.joints.size() &&
                        cell.robot.joints[joint].type == model::JointType::kPrismatic;
    text += fmt::format("{}joint {} {:.1f}{}", i == 0 ? "" : ", ", i + 1,
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
    text += "no pose that separates them is proposed.";
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

Statement VerdictStatement(const Diagnosis& diagnosis, const model::CellModel& cell) {
  Statement verdict = MarkOf(diagnosis.verdict);
  verdict.sentence = InWords(VerdictSentence(diagnosis, cell), diagnosis);
  verdict.reasons = {InWords(RestsOn(diagnosis), diagnosis)};
  const std::vector<std::string> reservations = Reservations(diagnosis);
  if (reservations.empty()) return verdict;
  std::string first = Shortened(reservations.front(), kMaxSentenceLength / 2);
  if (!first.ends_with('.') && !first.ends_with("\u2026")) first += '.';
  if (reservations.size() > 1) {
    first +=
        fmt::format(" {} more in the appendix.", CountText(reservations.size() - 1, "reservation"));
  }
  verdict.reasons.push_back(first);
  return verdict;
}

constexpr std::size_t kMaxNameLength = 48, kMaxWordLength = 24, kMaxParticularLength = 30,
                      kMaxInstrumentLength = 44, kMaxApproverLength = 32, kMaxFileLength = 60;
constexpr std::size_t kMaxItemLength = 64;
constexpr std::size_t kMaxCoefficients = 4, kMaxUntested = 2;
constexpr double kAllShares = 1.02, kMostShares = 0.85;

Statement ConformityStatement(const Conformity& conformity) {
  using enum Conformity::Outcome;
  std::vector<std::string> rule = {
      "Decision rule of ISO 14253-1: a pose conforms if |error| + U \u2264 tolerance."};
  switch (conformity.outcome) {
    case kConforms:
      return {"Conforms", "\u2713", "good", conformity.sentence, rule};
    case kWouldConform:
      return {"Would conform if corrected", "\u25b2", "caution", conformity.sentence, rule};
    case kDoesNotConform:
      return {"Does not conform", "\u25a0", "bad", conformity.sentence, rule};
    case kNotDecided:
      break;
  }
  return {"Undecided", "\u25b2", "caution", conformity.sentence, rule};
}

/// Conformity if a tolerance was stated, then the verdict.
std::string Statements(const CertificateInput& input) {
  const Statement verdict = VerdictStatement(input.diagnosis, input.cell);
  if (const auto& tolerance_m = input.source.certificate_details.tolerance_m)
    return StatementHtml(ConformityStatement(ConformityOf(input.achieved, *tolerance_m)),
                         "headline") +
           StatementHtml(verdict, "second");
  return StatementHtml(verdict, "headline") +
         "<p>No tolerance was stated (--tolerance-mm): this page makes no statement of "
         "conformity.</p>\n";
}

std::string OrNotStated(const std::string& text, std::size_t most = kMaxParticularLength) {
  return text.empty() ? "not stated" : Shortened(text, most);
}

std::string RangeText(const model::Interval& range, const char* unit) {
  // Both ends to the same digit.
  const auto whole = [](double value) { return std::abs(value - std::round(value)) < 0.05; };
  const int digits = whole(range.low) && whole(range.high) ? 0 : 1;
  if (range.low == range.high) return fmt::format("{:.{}f} {}", range.low, digits, unit);
  return fmt::format("{:.{}f} to {:.{}f} {}", range.low, digits, range.high, digits, unit);
}

std::string ParticularsTable(const CertificateInput& input) {
  const ReportSource& source = input.source;
  const CertificateDetails& details = source.certificate_details;
  const model::Domain& domain = input.diagnosis.domain;
  const model::Measurement& measurement = input.cell.measurement;
  const std::optional<double>& of_rows_m = input.diagnosis.row_sigma_m;
  const std::optional<double>& sigma_m = of_rows_m ? of_rows_m : measurement.sigma_m;
  std::string html = "<table class=\"particulars\"><tbody>\n";
  const auto add = [&html](const char* name, const std::string& text) {
    html += fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", name, Escape(text));
  };
  add("Robot serial no.", OrNotStated(details.robot_serial));
  add("Site", OrNotStated(details.site));
  add("Measured", OrNotStated(MeasuredText(input.diagnosis, details)));
  if (input.achieved.before) {
    add("Poses, rows", fmt::format("{}, {}", input.achieved.before->characteristics.poses.size(),
                                   input.achieved.rows));
  }
  add("Instrument", OrNotStated(details.instrument, kMaxInstrumentLength));
  add("Its serial no.", OrNotStated(details.instrument_serial));
  add("Its calibration", OrNotStated(details.calibration, kMaxInstrumentLength));
  add("Its uncertainty", sigma_m ? "\u03c3 = " + MillimetreText(*sigma_m) + " mm per axis, " +
                                       (of_rows_m ? "median of the rows" : "declared")
                                 : "not stated");
  std::string temperature =
      domain.temp_C ? RangeText(domain.temp_C->Hull(), "\u00b0C") : std::string("not recorded");
  if (measurement.reference_temperature_C) {
    temperature += fmt::format(", reference {:.3g} \u00b0C", *measurement.reference_temperature_C);
  }
  add("Valid at temperatures", temperature);
  add("Valid for payloads",
      domain.payload_kg ? RangeText(domain.payload_kg->Hull(), "kg") : "not recorded");
  add("Model, declared", OrNotStated(source.declared_fingerprint));
  add("Model, corrected",
      source.corrected_fingerprint.empty() ? "not written" : source.corrected_fingerprint);
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

/// A parameter found, with its place in the list of findings.
struct Coefficient {
  const Finding* finding;
  std::size_t value;
  double tip_rms_m;
};

/// Those that displace the tip most come first.
std::vector<Coefficient> CoefficientsOf(const Diagnosis& diagnosis) {
  std::vector<Coefficient> coefficients;
  for (const Finding& finding : diagnosis.findings) {
    const std::vector<double>& tip_m = finding.tip_rms_of_each_m;
    for (std::size_t k = 0; k < finding.effect.values.size(); ++k)
      coefficients.push_back({&finding, k, k < tip_m.size() ? tip_m[k] : 0});
  }
  std::ranges::stable_sort(coefficients, std::greater<>(), &Coefficient::tip_rms_m);
  return coefficients;
}

std::string CoefficientsTable(const Diagnosis& diagnosis) {
  if (diagnosis.findings.empty()) return "";
  HtmlTable table({"Change to the model", "Parameter", "Offset at the tip (mm)",
                   "Value &plusmn; U (k = 2)", "Unit"},
                  {0, 1, 4});
  const std::vector<Coefficient> coefficients = CoefficientsOf(diagnosis);
  for (std::size_t k = 0; k < std::min(coefficients.size(), kMaxCoefficients); ++k) {
    const Finding& finding = *coefficients[k].finding;
    const model::WrittenEffect written =
        effects::WrittenFromActive(finding.effect, finding.covariance);
    const std::vector<EmpiricalCurve> curves = EmpiricalCurvesOf(finding.effect);
    const std::size_t index = coefficients[k].value;
    const model::EffectParameter& parameter = written.parameters[index];
    const auto [value, unit] =
        ValueAndUnit(parameter, index < curves.size() ? &curves[index] : nullptr);
    table.AddRow({Escape(Shortened(Capitalized(EffectName(written.id)), kMaxWordLength)),
                  Escape(Shortened(ParameterInWords(parameter.name), kMaxWordLength)),
                  OffsetAtTheTip(finding, index), value, unit});
  }
  double shares = 0;
  std::string trend;
  for (const Finding& finding : diagnosis.findings) {
    shares += finding.share_of_residual;
    if (trend.empty()) trend = Capitalized(LinearTrendText(finding.effect));
  }
  std::vector<std::string> notes;
  if (!diagnosis.withheld.empty()) notes.emplace_back("Not written to the model.");
  notes.emplace_back("Offset at the tip: RMS over the measured poses, by this value alone.");
  if (!trend.empty()) notes.push_back(InWords(trend, diagnosis) + ".");
  if (coefficients.size() > kMaxCoefficients) {
    notes.push_back(CountText(coefficients.size() - kMaxCoefficients, "parameter") +
                    " with smaller offsets in the appendix.");
  }
  if (shares > kAllShares || shares < kMostShares) {
    notes.push_back(fmt::format(
        "An effect's share is what comes back without it; those of effects that act alike add up "
        "to {} than 100 %.",
        shares > kAllShares ? "more" : "less"));
  }
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
    items.push_back(Shortened(InWords(missing[k], input.diagnosis), kMaxItemLength));
  }
  if (missing.size() > kMaxUntested) {
    items.push_back(fmt::format("{} more in the appendix", missing.size() - kMaxUntested));
  }
  items.emplace_back("poses, payloads and temperatures beyond those measured");
  return "<p class=\"soft untested\"><b>Not tested:</b> " +
         Escape(fmt::format("{}", fmt::join(items, "; "))) + ".</p>\n";
}

std::string Approval(const ReportSource& source) {
  const std::string blank = "<span class=\"blank\">&nbsp;</span>";
  const std::string& approver = source.certificate_details.approved_by;
  std::string html = "<table class=\"approval\"><tbody><tr><td>Approved by<br>" +
                     (approver.empty() ? blank : Escape(Shortened(approver, kMaxApproverLength))) +
                     "</td><td>Date<br>" + blank + "</td><td>Signature<br>" + blank +
                     "</td></tr></tbody></table>\n<p class=\"digest\">SHA-256 ";
  const auto digest = [](const std::string& file, const std::string& hex) {
    return Escape(Shortened(file, kMaxFileLength)) + " " + (hex.empty() ? "not computed" : hex);
  };
  return html + digest(source.data_file, source.data_sha256) + "<br>SHA-256 " +
         digest(source.cell_file, source.cell_sha256) + "</p>\n";
}

/// Caption of a figure.
std::string CaptionHtml(const CertificateFigure& figure) {
  return fmt::format("<p class=\"caption\"><b>{}.</b> {}</p>\n", Escape(figure.title),
                     Escape(Shortened(figure.sentence, kMaxSentenceLength)));
}

std::string CertificateFigureHtml(const CertificateFigure& figure, const char* style) {
  std::string drawings;
  for (const Panel& panel : figure.panels) drawings += panel.svg;
  if (drawings.empty()) return "";
  return fmt::format("<div class=\"plot {}\">{}<div class=\"{}\">{}</div></div>\n", style,
                     CaptionHtml(figure), figure.panels.size() == 1 ? "wide" : "pair", drawings);
}

/// The page's parts other than its figures, from top to bottom; `left` and `right` are beside each
/// other.
struct CertificateParts {
  std::string top, left, right, bottom;
};

CertificateParts CertificatePartsOf(const CertificateInput& input) {
  const ReportSource& source = input.source;
  CertificateParts parts;
  parts.top = fmt::format(
      "<header>\n<h1>{}</h1>\n<p>Accuracy certificate, number: {}</p>\n<p class=\"soft\">Written "
      "{} by Plumbline {}</p>\n</header>\n",
      Escape(Shortened(input.cell.robot.name, kMaxNameLength)),
      Escape(OrNotStated(source.certificate_details.number)), Escape(UtcInWords(source.utc)),
      Escape(source.version));
  parts.top += Statements(input);
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
  parts.left += NotTested(input);
  parts.right = ParticularsTable(input);
  parts.bottom = CoefficientsTable(input.diagnosis) + Approval(source);
  return parts;
}

}  // namespace

double CertificateTextHeight_mm(const CertificateInput& input) {
  constexpr double kTitle_mm = 6, kAround_mm = 8, kSignature_mm = 4;  // not in paragraphs or rows
  const CertificateParts parts = CertificatePartsOf(input);
  double height_mm = kTitle_mm + kAround_mm + kSignature_mm + PrintedHeight_mm(parts.top) +
                     std::max(PrintedHeight_mm(parts.left), PrintedHeight_mm(parts.right)) +
                     PrintedHeight_mm(parts.bottom);
  for (const CertificateFigure* const figure : {&input.points, &input.deciding}) {
    if (!figure->panels.empty()) height_mm += PrintedHeight_mm(CaptionHtml(*figure));
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
