// Text of a diagnosis shared by the terminal summary, the JSON answer and the report.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "app/measure/diagnosis/result/diagnosis.h"
#include "firmware-like/effects/written.h"

namespace plumbline::measure {

// Unit and label of a recorded signal, from its column name.

/// "bar" for "air_pressure_bar", "deg/s" for "qd2_deg_s", "unit of counter" for "counter".
/// Temperature differences are in K.
std::string UnitOfSignal(std::string_view column);

/// The column in words with its unit: "joint 5 (deg)" for "q5_deg", "time (s)" for "t_s", "air
/// pressure (bar)" for "air_pressure_bar". Without the unit if it does not end with a known one.
std::string SignalLabel(std::string_view column);

/// Display name of an effect: "joint compliance". The id with spaces if the effect has no name.
std::string EffectName(std::string_view id);

/// "joint compliance on axes 2 and 3"; the name alone if `scope` is empty.
std::string EffectName(std::string_view id, const std::vector<std::string>& scope);
/// "backlash on axis 2 (load)", "a step at one moment (base)": the variant follows in parentheses
/// if the effect has one.
std::string EffectName(std::string_view id, std::string_view word,
                       const std::vector<std::string>& scope);
std::string EffectName(const Finding& finding);

/// Slope of an empirical term whose curve deviates from a straight line by at most 5 % of its rise:
/// "linear: the base moves 73.5 mm per bar (x 43.0, y 49.4, z -33.3)". Empty for a nonlinear curve,
/// a term of two signals, and an effect of the catalogue.
std::string LinearTrendText(const effects::ActiveEffect& effect);
/// "1, 23 or 25 cycles per turn".
std::string CyclesText(const std::set<double>& cycles);

/// Name of a rival, and of the finding that it would replace; with the variants if both have the
/// same id and differ in the variant only.
std::string RivalName(const Rival& rival);
std::string ReplacedName(const Rival& rival);

/// The text with its first letter in upper case.
std::string Capitalized(std::string text);

/// The items joined as "a, b and c", or with another conjunction: "a, b or c".
std::string Listed(const std::vector<std::string>& items, std::string_view last = "and");

/// A length in mm with its significant digits, without the unit: "8.64", "0.087", "<0.001".
std::string MillimetreText(double metres);

/// "93 %", "<1 %"; a share below 1 is never rounded up to "100 %" (">99 %" instead).
std::string PercentText(double share);

/// A value rounded to the second significant digit of its standard deviation, and that deviation:
/// {"5.100e-07", "2.0e-09"}. Without a deviation: four significant digits and an empty `sd`.
struct ValueText {
  std::string value, sd;
};
ValueText ValueTextOf(double value, std::optional<double> sd);

/// Source of the noise estimate: "declared", "from repeats", "from the residual".
std::string OriginText(const std::string& origin);

/// "payload_kg of 80 or more", "tool 2"
std::string TextOf(const RowCondition& condition);

/// True if the answer contains an empirical term.
bool HasEmpiricalTerm(const Diagnosis& diagnosis);

/// Measuring conditions of a proposed pose other than joints and payload: "wait 20 min, q3 rising";
/// empty if there are none.
std::string MeasuringText(const NextPose& pose);

// Parameters of effects as the summary, the report and the certificate show them.

/// Scale and unit in which a parameter is shown: lengths that files have in metres are shown in mm.
struct ShownUnit {
  double scale = 1;
  std::string unit;
};

inline ShownUnit ShownUnitOf(const model::EffectParameter& parameter) {
  if (parameter.unit == "m") return {1e3, "mm"};
  return {1, parameter.unit};
}

/// Value of a parameter in its shown unit, with `deviations` times its standard deviation, or its
/// word.
inline ValueText ShownValueOf(const model::EffectParameter& parameter, double deviations = 1) {
  if (!parameter.word.empty()) return {parameter.word, ""};
  const double scale = ShownUnitOf(parameter).scale;
  const auto sd = parameter.sd ? std::optional(scale * deviations * *parameter.sd) : std::nullopt;
  return ValueTextOf(scale * parameter.value, sd);
}

/// The curve of one parameter of an empirical term.
struct EmpiricalCurve {
  std::string meaning;  ///< "the tool's bending", "axis 3", "length a of link 2", "the tip in z"
  std::string range;    ///< smallest and largest value of the curve: "0 to 19.6"
  std::string unit;     ///< "%", "mrad", "mm"
};

/// One curve for each parameter; none if the effect is not an empirical term.
std::vector<EmpiricalCurve> EmpiricalCurvesOf(const effects::ActiveEffect& effect);

}  // namespace plumbline::measure
