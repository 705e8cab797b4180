#include "app/measure/diagnosis/empirical_curve.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "firmware-like/effects/parameter_name.h"

namespace plumbline::measure {
namespace {

constexpr double kInPercent = 100, kMilli = 1e3;  // nodes of joints are in rad or m

/// "-3.1 to 19.6", both ends to the third digit of the larger one; empty ends are 0.
std::string CurveRange(double low, double high) {
  const double largest = std::max(std::abs(low), std::abs(high));
  const int power = largest > 0 ? static_cast<int>(std::floor(std::log10(largest))) : 0;
  const int digits = std::clamp(2 - power, 0, 9);
  const double zero = 0.5 * std::pow(10, -digits);
  const auto text = [&](double value) {
    return std::abs(value) < zero ? std::string("0") : fmt::format("{:.{}f}", value, digits);
  };
  return text(low) + " to " + text(high);
}

}  // namespace

std::vector<EmpiricalCurve> EmpiricalCurvesOf(const effects::ActiveEffect& effect) {
  const effects::EffectTerm& term = effect.term;
  const auto first = static_cast<Eigen::Index>(term.drivers.size());
  const auto count = static_cast<Eigen::Index>(term.parameters.size());
  if (!term.effect->traits().empirical || term.nodes.rows() == 0 ||
      term.nodes.cols() != first + count) {
    return {};
  }
  std::vector<EmpiricalCurve> curves;
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto at = static_cast<std::size_t>(k);
    const effects::TermParameter& parameter = term.parameters[at];
    const std::string name = effects::NameFromParameter(term.effect->traits(), parameter);
    EmpiricalCurve curve;
    double factor = effect.values[at];
    if (name.starts_with("base_") || name.starts_with("tip_")) {
      curve.meaning = fmt::format("the {} in {}", name.substr(0, name.find('_')),
                                  name.substr(name.find('_') + 1));
      curve.unit = "mm";
    } else if (name == "tool_bending") {
      curve.meaning = "the tool\u2019s bending";
      curve.unit = "%";
      factor *= kInPercent;
    } else if (name.starts_with("a") || name.starts_with("d")) {
      curve.meaning =
          (name.front() == 'a' ? "length a of link " : "offset d of link ") + name.substr(1);
      curve.unit = "mm";
    } else {
      curve.meaning = "axis" + (name.empty() ? name : " " + name.substr(1));
      const bool slides = (term.prismatic >> static_cast<unsigned>(parameter.joint) & 1U) != 0;
      curve.unit = slides ? "mm" : "mrad";
      factor *= kMilli;
    }
    const auto values = (term.nodes.col(first + k).array() * factor).eval();
    curve.range = CurveRange(values.minCoeff(), values.maxCoeff());
    curves.push_back(std::move(curve));
  }
  return curves;
}

}  // namespace plumbline::measure
