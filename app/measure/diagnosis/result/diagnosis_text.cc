#include "app/measure/diagnosis/result/diagnosis_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

#include "app/measure/diagnosis/linear/candidates.h"
#include "firmware-like/effects/catalogue.h"
#include "firmware-like/effects/parameter_name.h"

namespace plumbline::measure {
namespace {

constexpr std::pair<std::string_view, std::string_view> kOfTwoParts[] = {
    {"_deg_s2", "deg/s^2"}, {"_deg_s", "deg/s"}, {"_mm_s2", "mm/s^2"}, {"_mm_s", "mm/s"}};
constexpr std::pair<std::string_view, std::string_view> kOfOnePart[] = {
    {"_s", "s"},   {"_deg", "deg"}, {"_rad", "rad"}, {"_mm", "mm"},   {"_m", "m"},
    {"_kg", "kg"}, {"_bar", "bar"}, {"_N", "N"},     {"_Nm", "N m"},  {"_A", "A"},
    {"_V", "V"},   {"_W", "W"},     {"_Hz", "Hz"},   {"_rpm", "rpm"}, {"_C", "\u00b0C"}};

constexpr std::pair<std::string_view, std::string_view> kOfJoint[] = {
    {"q", ""}, {"qd", "speed of "}, {"qdd", "acceleration of "}, {"tau", "torque of "}};

/// "speed of joint 5" for "qd5"; the name itself with blanks for any other.
std::string InWords(std::string name) {
  const std::size_t digits = std::min(name.find_first_of("0123456789"), name.size());
  const std::string_view number = std::string_view(name).substr(digits);
  const bool numbered =
      !number.empty() && number.find_first_not_of("0123456789") == std::string_view::npos;
  for (const auto& [stem, quantity] : kOfJoint) {
    if (numbered && std::string_view(name).substr(0, digits) == stem)
      return fmt::format("{}joint {}", quantity, number);
  }
  if (name == "t") return "time";
  if (name == "temp") return "temperature";
  std::ranges::replace(name, '_', ' ');
  return name;
}

}  // namespace

std::string UnitOfSignal(std::string_view column) {
  for (const auto& [ending, unit] : kOfTwoParts) {
    if (column.ends_with(ending)) return std::string(unit);
  }
  const std::size_t at = column.rfind('_');
  if (at == std::string_view::npos) return fmt::format("unit of {}", column);
  const std::string_view unit = column.substr(at + 1);
  return unit == "C" ? "K" : std::string(unit);
}

std::string SignalLabel(std::string_view column) {
  std::string_view unit, ending;
  for (const auto& [of_ending, of_unit] : kOfOnePart) {
    if (column.ends_with(of_ending)) std::tie(ending, unit) = std::tie(of_ending, of_unit);
  }
  for (const auto& [of_ending, of_unit] : kOfTwoParts) {
    if (column.ends_with(of_ending)) std::tie(ending, unit) = std::tie(of_ending, of_unit);
  }
  const bool has_unit = !ending.empty() && ending.size() < column.size();
  if (!has_unit) return InWords(std::string(column));
  return fmt::format("{} ({})",
                     InWords(std::string(column.substr(0, column.size() - ending.size()))), unit);
}

namespace {

constexpr double kPercent = 100;

}  // namespace

std::string EffectName(std::string_view id) {
  const effects::Effect* effect = effects::FindEffect(id);
  if (effect != nullptr && !effect->traits().name.empty())
    return std::string(effect->traits().name);
  std::string name(id);
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

std::string EffectName(std::string_view id, const std::vector<std::string>& scope) {
  if (scope.empty()) return EffectName(id);
  std::vector<std::string> axes;
  axes.reserve(scope.size());
  for (const std::string& joint : scope) axes.push_back(joint.substr(joint.starts_with('q')));
  return EffectName(id) + (axes.size() == 1 ? " on axis " : " on axes ") + Listed(axes);
}

std::string EffectName(std::string_view id, std::string_view word,
                       const std::vector<std::string>& scope) {
  std::string name = EffectName(id, scope);
  if (!word.empty()) name += fmt::format(" ({})", word);
  return name;
}

std::string CyclesText(const std::set<double>& cycles) {
  if (cycles == std::set<double>{1}) return "1 cycle per turn";
  std::vector<std::string> texts;
  texts.reserve(cycles.size());
  for (const double value : cycles) texts.push_back(fmt::format("{:.3g}", value));
  return Listed(texts, "or") + " cycles per turn";
}

std::string RivalName(const Rival& rival) {
  if (rival.cycles) return EffectName(rival.id, CyclesText({*rival.cycles}), rival.scope);
  if (!rival.along.empty()) return "another function of " + rival.along;
  const std::string name =
      EffectName(rival.id, rival.id == rival.instead_of ? rival.word : "", rival.scope);
  return rival.only.empty() ? name : name + " with " + rival.only + " only";
}

std::string ReplacedName(const Rival& rival) {
  if (rival.cycles) return CyclesText({*rival.instead_of_cycles});
  return EffectName(rival.instead_of, rival.id == rival.instead_of ? rival.instead_of_word : "",
                    {});
}

std::string EffectName(const Finding& finding) {
  const model::WrittenEffect written = effects::WrittenFromActive(finding.effect, {});
  return EffectName(written.id, written.scope);
}

std::string Capitalized(std::string text) {
  if (!text.empty() && text[0] >= 'a' && text[0] <= 'z') {
    text[0] = static_cast<char>(text[0] - 'a' + 'A');
  }
  return text;
}

std::string Listed(const std::vector<std::string>& items, std::string_view last) {
  std::string text;
  for (std::size_t k = 0; k < items.size(); ++k) {
    if (k > 0) text += k + 1 == items.size() ? fmt::format(" {} ", last) : ", ";
    text += items[k];
  }
  return text;
}

std::string MillimetreText(double metres) {
  const double mm = 1e3 * metres;
  const double size = std::abs(mm);
  if (!std::isfinite(mm)) return "unknown";
  if (size == 0) return "0";
  if (size < 1e-3) return "<0.001";
  return fmt::format("{:.{}f}", mm, size < 0.1 ? 3 : size < 10 ? 2 : 1);
}

std::string PercentText(double share) {
  if (!std::isfinite(share)) return "unknown";
  if (share > 0 && share < 0.005) return "<1 %";
  if (share < 1 && share > 0.995) return ">99 %";
  return fmt::format("{:.0f} %", kPercent * share);
}

namespace {

/// Slope of each carrier per unit of the driver, by least squares over the nodes; nullopt if the
/// curve is not straight.
std::optional<Eigen::VectorXd> SlopesOf(const Eigen::MatrixXd& nodes) {
  constexpr double kStraight = 0.05;          // of the rise
  if (nodes.rows() < 3) return std::nullopt;  // any two points lie on a line
  const Eigen::VectorXd x = nodes.col(0).array() - nodes.col(0).mean();
  const Eigen::MatrixXd curves = nodes.rightCols(nodes.cols() - 1);
  const Eigen::MatrixXd centred = curves.rowwise() - curves.colwise().mean();
  const Eigen::VectorXd slopes = centred.transpose() * x / x.squaredNorm();
  const double rise = slopes.norm() * (x.maxCoeff() - x.minCoeff());
  const double bend = (centred - x * slopes.transpose()).rowwise().norm().maxCoeff();
  return rise > 0 && bend <= kStraight * rise ? std::optional(slopes) : std::nullopt;
}

}  // namespace

std::string LinearTrendText(const effects::ActiveEffect& effect) {
  const effects::EffectTerm& term = effect.term;
  if (!term.effect->traits().empirical || term.drivers.size() != 1) return "";
  const auto slopes = SlopesOf(term.nodes);
  if (!slopes) return "";
  const std::string per = "per " + UnitOfSignal(term.drivers.front());
  std::map<std::string, std::vector<std::pair<std::string, double>>> axes;  // by "base" and "tip"
  std::vector<std::string> texts;
  for (std::size_t k = 0; k < term.parameters.size(); ++k) {
    const std::string name = effects::NameFromParameter(term.effect->traits(), term.parameters[k]);
    const double slope = effect.values[k] * (*slopes)[static_cast<Eigen::Index>(k)];
    const bool shifts = name.starts_with("base_") || name.starts_with("tip_");
    if (shifts) {
      axes[name.substr(0, name.find('_'))].emplace_back(name.substr(name.find('_') + 1), slope);
    } else if (name.starts_with("tilt_")) {
      texts.push_back(fmt::format("the base turns {:.3g} mrad {} about {}", 1e3 * slope, per,
                                  name.substr(name.find('_') + 1)));
    } else if (name == "tool_bending") {
      texts.push_back(
          fmt::format("the tool's bending changes by {:+.3g} % {}", kPercent * slope, per));
    } else if (name.starts_with("a") || name.starts_with("d")) {
      texts.push_back(fmt::format("{} of the DH table changes by {:+.3g} mm {}", name, slope, per));
    } else if ((term.prismatic >> static_cast<unsigned>(term.parameters[k].joint) & 1U) != 0) {
      texts.push_back(fmt::format("{} moves {:.3g} mm {}", name, 1e3 * slope, per));
    } else {
      texts.push_back(fmt::format("{} turns {:.3g} mrad {}", name, 1e3 * slope, per));
    }
  }
  for (const auto& [what, of_axes] : axes) {
    double square = 0;
    std::vector<std::string> parts;
    for (const auto& [axis, slope] : of_axes) {
      square += slope * slope;
      parts.push_back(fmt::format("{} {:.3g}", axis, slope));
    }
    texts.push_back(fmt::format("the {} moves {:.3g} mm {} ({})", what, std::sqrt(square), per,
                                fmt::join(parts, ", ")));
  }
  return "linear: " + fmt::format("{}", fmt::join(texts, "; "));
}

ValueText ValueTextOf(double value, std::optional<double> sd) {
  if (!std::isfinite(value)) return {"unknown", ""};
  const bool known = sd && std::isfinite(*sd) && *sd > 0;
  if (!known) return {fmt::format("{:.4g}", value), ""};
  const double largest = std::max(std::abs(value), *sd);
  const int exponent = static_cast<int>(std::floor(std::log10(largest)));
  const int last_digit = static_cast<int>(std::floor(std::log10(*sd))) - 1;
  if (exponent < -3 || exponent > 5) {
    const int digits = std::clamp(exponent - last_digit, 1, 9);
    return {fmt::format("{:.{}e}", value, digits), fmt::format("{:.1e}", *sd)};
  }
  const int digits = std::clamp(-last_digit, 0, 9);
  return {fmt::format("{:.{}f}", value, digits), fmt::format("{:.{}f}", *sd, digits)};
}

std::string OriginText(const std::string& origin) {
  if (origin == "repeats") return "from repeats";
  if (origin == "residual") return "from the residual";
  return origin;
}

std::string TextOf(const RowCondition& condition) {
  if (!condition.name.empty()) return condition.column + " " + condition.name;
  return fmt::format("{} of {:.6g} or {}", condition.column, condition.limit,
                     condition.above ? "more" : "less");
}

bool HasEmpiricalTerm(const Diagnosis& diagnosis) {
  return std::ranges::any_of(diagnosis.findings, [](const Finding& finding) {
    return finding.effect.term.effect->traits().empirical;
  });
}

std::string MeasuringText(const NextPose& pose) {
  std::vector<std::string> texts;
  if (pose.wait_s > 0) texts.push_back(fmt::format("wait {:.4g} min", pose.wait_s / 60));
  for (const double sign : {-1.0, 1.0}) {
    std::vector<std::string> joints;
    for (Eigen::Index i = 0; i < pose.via_q.size(); ++i) {
      if ((pose.q[i] - pose.via_q[i]) * sign > 0) joints.push_back(fmt::format("q{}", i + 1));
    }
    if (joints.empty()) continue;
    texts.push_back(fmt::format("{} {}", Listed(joints), sign > 0 ? "rising" : "falling"));
  }
  const bool moves =
      (pose.qd.size() > 0 && !pose.qd.isZero()) || (pose.qdd.size() > 0 && !pose.qdd.isZero());
  if (moves) {
    texts.emplace_back("in motion");
  } else if (pose.qd.size() > 0 || pose.qdd.size() > 0) {
    texts.emplace_back("at rest");
  }
  return fmt::format("{}", fmt::join(texts, ", "));
}

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
    } else if (name.starts_with("tilt_")) {
      curve.meaning = "the tilt of the base about " + name.substr(name.find('_') + 1);
      curve.unit = "mrad";
      factor *= kMilli;
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
