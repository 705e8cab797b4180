// Report sections on the result: verdict, residuals, effects, correlations.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <tuple>

#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "app/measure/report/html.h"
#include "app/measure/report/sections.h"
#include "app/measure/report/words.h"

namespace plumbline::measure {
namespace {

constexpr std::size_t kMaxPairs = 5;
constexpr double kNoteworthy = 0.5;  // weaker correlations are left out
constexpr double kUnbounded = 1e100;
constexpr double kStrong = 0.9;  // correlations above this are emphasised

/// Lengths of a residual over all rows that have it, outliers excluded [m], ascending.
template <typename Residual>
std::vector<double> Sizes(const Diagnosis& diagnosis, Residual RowTrace::*residual) {
  std::vector<double> sizes;
  for (const RowTrace& row : diagnosis.rows) {
    const std::optional<Vec3> of_row = row.*residual;
    if (of_row && !row.outlier) sizes.push_back(of_row->norm());
  }
  std::ranges::sort(sizes);
  return sizes;
}

std::string Quantile(const std::vector<double>& ascending, double share) {
  if (ascending.empty()) return "";
  const double at = share * static_cast<double>(ascending.size() - 1);
  return Escape(MillimetreText(ascending[std::lround(at)]));
}

void AddErrorRow(HtmlTable& table, const std::string& what, double rms_m, const std::string& range,
                 const std::vector<double>& sizes, bool strong) {
  table.AddRow({what, Escape(MillimetreText(rms_m)), range, Quantile(sizes, 0.5),
                Quantile(sizes, 0.95), Quantile(sizes, 1)},
               strong);
}

/// Percentage with a non-breaking space.
std::string PercentHtml(double share) {
  std::string html = Escape(PercentText(share));
  if (const auto blank = html.find(' '); blank != std::string::npos) {
    html.replace(blank, 1, "&nbsp;");
  }
  return html;
}

/// @param scale  from the unit of files to the shown one
std::string PlausibleText(const effects::ParameterSpec& spec, const model::Interval& plausible,
                          double scale) {
  const auto end = [&](double in_file) {
    const double value = scale * in_file;
    const bool small = value != 0 && std::abs(value) < 0.01;
    return NumberHtml(small ? fmt::format("{:.0e}", value) : fmt::format("{:.4g}", value));
  };
  if (spec.role == effects::ParameterRole::kWord) return "";
  if (std::abs(plausible.low) > kUnbounded || std::abs(plausible.high) > kUnbounded) return "";
  return plausible.low == -plausible.high ? "&plusmn;" + end(plausible.high)
                                          : end(plausible.low) + " to " + end(plausible.high);
}

const effects::ParameterSpec* SpecOf(const Finding& finding, std::size_t k) {
  const effects::EffectTerm& term = finding.effect.term;
  if (k >= term.parameters.size()) return nullptr;
  return &term.effect->traits().parameters[term.parameters[k].spec];
}

/// Names of all parameters in the order of the correlation matrix: "base frame, x" for "base_frame
/// x".
std::vector<std::string> CorrelationNames(const Diagnosis& diagnosis) {
  std::vector<std::string> names = diagnosis.finding_names;
  for (std::string& name : names) {
    const std::size_t end = name.find(' ');
    name = end == std::string::npos
               ? ParameterInWords(name)
               : EffectName(name.substr(0, end)) + ", " + ParameterInWords(name.substr(end + 1));
  }
  return names;
}

/// The strongest pairs, strongest first: -|r|, row, column.
std::vector<std::tuple<double, Eigen::Index, Eigen::Index>> PairsOf(
    const Eigen::MatrixXd& correlation) {
  std::vector<std::tuple<double, Eigen::Index, Eigen::Index>> pairs;
  for (Eigen::Index i = 0; i < correlation.rows(); ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      const double strength = std::abs(correlation(i, j));
      if (strength > kNoteworthy) pairs.emplace_back(-strength, j, i);
    }
  }
  std::ranges::sort(pairs);
  return pairs;
}

}  // namespace

std::vector<std::string> Reservations(const Diagnosis& diagnosis) {
  std::vector<std::string> lines;
  const auto add = [&](const std::string& line) { lines.push_back(InWords(line, diagnosis)); };
  if (!diagnosis.withheld.empty()) add("No correction: " + diagnosis.withheld);
  for (const ExplanationCheck& check : diagnosis.checks) {
    if (check.effect.empty() && !check.passed) add("Not explained: " + check.sentence);
  }
  for (const Doubt& doubt : diagnosis.doubts)
    add("In doubt: " + EffectName(doubt.id, doubt.scope) + ": " + doubt.reason);
  for (const Finding& finding : diagnosis.findings) {
    if (!finding.implausible.empty())
      add("Implausible: " + EffectName(finding) + ": " + finding.implausible);
  }
  return lines;
}

std::string ErrorTable(const Diagnosis& diagnosis) {
  HtmlTable table(
      {"Residual (mm)", "RMS", "95 % interval of the RMS", "Median", "95th percentile", "Maximum"},
      {0});
  const bool corrected = !diagnosis.findings.empty();
  AddErrorRow(table, "All rows, declared model", diagnosis.rms_before_m, "",
              Sizes(diagnosis, &RowTrace::before), false);
  if (corrected) {
    AddErrorRow(table, "All rows, corrected model", diagnosis.rms_after_m, "",
                Sizes(diagnosis, &RowTrace::after), false);
  }
  if (!diagnosis.held_out_by.empty()) {
    const HeldOutError& error = diagnosis.held_out;
    AddErrorRow(table, "Held out, declared model", error.before_m, "",
                Sizes(diagnosis, &RowTrace::held_out_before), false);
    if (corrected) {
      AddErrorRow(table, "Held out, corrected model", error.after_m,
                  Escape(fmt::format("{} to {}", MillimetreText(error.after_low_m),
                                     MillimetreText(error.after_high_m))),
                  Sizes(diagnosis, &RowTrace::held_out_after), true);
    }
  }
  table.AddRow({"Noise floor, " + Escape(OriginText(diagnosis.noise_floor_origin)),
                Escape(MillimetreText(diagnosis.noise_floor_m)), "", "", "", ""});
  if (diagnosis.noise_floor_origin != diagnosis.sigma_origin && diagnosis.noise_in_use_m > 0) {
    table.AddRow({"Noise in use, " + Escape(OriginText(diagnosis.sigma_origin)),
                  Escape(MillimetreText(diagnosis.noise_in_use_m)), "", "", "", ""});
  }
  std::string html = table.Html();
  html += "<p class=\"soft\">Length of the 3-D residual: measured minus predicted tip position";
  if (!diagnosis.outlier_rows.empty()) html += ", outliers excluded";
  const auto held_out = std::ranges::count_if(
      diagnosis.rows, [](const RowTrace& row) { return row.held_out_after.has_value(); });
  if (held_out > 0 && held_out < static_cast<std::ptrdiff_t>(diagnosis.rows.size())) {
    html += fmt::format("; {} of {} rows, evenly spread, were held out in turn", held_out,
                        diagnosis.rows.size());
  }
  html += ". The noise floor is &radic;3 times the standard deviation of one axis";
  return html + (diagnosis.held_out_by.empty() || !corrected
                     ? ".</p>\n"
                     : "; the interval is a bootstrap over groups of rows.</p>\n");
}

std::string OffsetAtTheTip(const Finding& finding, std::size_t value) {
  const bool known =
      value < finding.tip_rms_of_each_m.size() && finding.tip_rms_of_each_m[value] > 0;
  return known ? Escape(MillimetreText(finding.tip_rms_of_each_m[value])) : "";
}

std::string EffectsBlock(const Diagnosis& diagnosis) {
  if (diagnosis.findings.empty()) return "";
  std::string html;
  HtmlTable table({"Effect", "Parameter", "Offset at the tip (mm)", "Value", "Standard uncertainty",
                   "Unit", "Plausible range"},
                  {0, 1, 5});
  for (const Finding& finding : diagnosis.findings) {
    const effects::EffectTraits& traits = finding.effect.term.effect->traits();
    html += "<p><strong>" + Escape(Capitalized(EffectName(finding))) + ".</strong> " +
            Escape(Capitalized(std::string(traits.meaning))) + ". ";
    html +=
        fmt::format("Without it, {} of the residual's sum of squares comes back ({}).",
                    PercentHtml(finding.share_of_residual),
                    finding.p_value < 1e-4 ? "p &lt; 0.0001"
                                           : Escape(fmt::format("p = {:.2g}", finding.p_value)));
    if (finding.tip_rms_m > 0) {
      html += " At the measured poses it displaces the tip by " +
              Escape(MillimetreText(finding.tip_rms_m)) + " mm RMS.";
    }
    for (const EmpiricalCurve& curve : EmpiricalCurvesOf(finding.effect)) {
      html += " Over the measured range, it changes " + Escape(curve.meaning) + " by " +
              Escape(curve.range + " " + curve.unit) + ".";
    }
    if (const std::string trend = LinearTrendText(finding.effect); !trend.empty())
      html += " " + Escape(InWords(Capitalized(trend), diagnosis)) + ".";
    html += " <em>What to do.</em> " + Escape(Capitalized(std::string(traits.remedy))) + ".</p>\n";
    if (!finding.implausible.empty()) {
      html += "<p class=\"note\">Implausible for a healthy machine: " +
              Escape(InWords(finding.implausible, diagnosis)) + "</p>\n";
    }
    const model::WrittenEffect written =
        effects::WrittenFromActive(finding.effect, finding.covariance);
    for (std::size_t k = 0; k < written.parameters.size(); ++k) {
      const model::EffectParameter& parameter = written.parameters[k];
      const effects::ParameterSpec* spec = SpecOf(finding, k);
      const effects::EffectTerm& term = finding.effect.term;
      const int joint = spec != nullptr ? term.parameters[k].joint : -1;
      const ValueText shown = ShownValueOf(parameter);
      const auto [scale, unit] = ShownUnitOf(parameter);
      table.AddRow(
          {k == 0 ? Escape(Capitalized(EffectName(written.id))) : "",
           Escape(ParameterInWords(parameter.name)), OffsetAtTheTip(finding, k),
           parameter.word.empty() ? NumberHtml(shown.value) : Escape(shown.value),
           NumberHtml(shown.sd), Escape(unit == "1" ? "" : unit),
           spec != nullptr
               ? PlausibleText(*spec, effects::PlausibleOf(*spec, term.word, term.prismatic, joint),
                               scale)
               : ""});
    }
  }
  return html + "<div class=\"parameters\">" + table.Html() +
         "</div><p class=\"soft\">Offset at the tip: RMS over the measured poses, by this value "
         "alone. "
         "Values are added to, or multiply, the declared values of the cell. "
         "Standard uncertainty: k = 1, propagated from the fit. Plausible range: of a healthy "
         "machine.</p>\n";
}

std::string CorrelationBlock(const Diagnosis& diagnosis) {
  const Eigen::MatrixXd& correlation = diagnosis.correlation;
  const std::vector<std::string> names = CorrelationNames(diagnosis);
  if (correlation.rows() < 2 || correlation.rows() != correlation.cols() ||
      static_cast<std::size_t>(correlation.rows()) != names.size()) {
    return "";
  }
  const auto pairs = PairsOf(correlation);
  if (pairs.empty()) {
    return fmt::format("<p>No two parameters are correlated by more than {}.</p>\n", kNoteworthy);
  }
  HtmlTable table({"Parameter", "Parameter", "Correlation"}, {0, 1});
  for (const auto& [strength, i, j] : std::span(pairs).first(std::min(pairs.size(), kMaxPairs))) {
    table.AddRow(
        {Escape(names[i]), Escape(names[j]), NumberHtml(fmt::format("{:.2f}", correlation(i, j)))},
        -strength > kStrong);
  }
  return table.Html() +
         fmt::format(
             "<p class=\"soft\">{} above {} in size. Near &plusmn;1, the data determine a "
             "combination of the two parameters better than either of them.</p>\n",
             pairs.size() > kMaxPairs
                 ? fmt::format("The strongest of {} correlations", pairs.size())
                 : std::string("Correlations"),
             kNoteworthy);
}

}  // namespace plumbline::measure
