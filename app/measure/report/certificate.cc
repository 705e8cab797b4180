#include "app/measure/report/certificate.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "app/measure/diagnosis/diagnosis_text.h"
#include "app/measure/diagnosis/empirical_curve.h"
#include "app/measure/diagnosis/headline.h"
#include "app/measure/diagnosis/shown_parameter.h"
#include "app/measure/report/certificate_layout.h"
#include "app/measure/report/certificate_text.h"
#include "app/measure/report/certificate_verdict.h"
#include "app/measure/report/html.h"
#include "firmware-like/geometry/angle.h"
#include "firmware-like/geometry/length.h"

namespace plumbline::measure {
namespace {

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
  const bool displaces = std::any_of(diagnosis.findings.begin(), diagnosis.findings.end(),
                                     [](const Finding& finding) { return finding.tip_rms_m > 0; });
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
