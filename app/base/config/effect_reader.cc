#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "app/base/config/cell_reader.h"
#include "firmware-like/effects/catalogue.h"
#include "firmware-like/effects/empirical.h"
#include "firmware-like/effects/parameter_name.h"

namespace plumbline::config {
namespace {

constexpr NumberRange kAnyNumber{-1e12, 1e12};
constexpr NumberRange kStandardDeviation{0, 1e12};
constexpr double kSymmetryTolerance = 1e-6;    // relative to the product of the standard deviations
constexpr double kEigenvalueTolerance = 1e-6;  // of the correlation matrix

/// The word of a parameter such as `by`; adds a fault if it is not one of `words`.
std::string WordFromToml(const TomlTable& table, std::string_view words) {
  const std::vector<std::string_view> choices = effects::Choices(words);
  if (!table.Has("value")) table.AddMissing("value", TomlTable::OneOfText(choices));
  const auto index = table.OneOf("value", choices);
  return index ? std::string(choices[*index]) : std::string();
}

/// The catalogue entry of a parameter; adds a fault if the effect has none of that name.
const effects::ParameterSpec* SpecFromName(const TomlTable& table,
                                           const effects::EffectTraits& effect,
                                           const std::string& name, int joint_count) {
  if (const auto parameter = effects::ParameterFromName(effect, name, joint_count)) {
    return &effect.parameters[static_cast<std::size_t>(parameter->spec)];
  }
  std::string names;
  for (const effects::ParameterSpec& known : effect.parameters) {
    names += (names.empty() ? "" : ", ") + std::string(known.name);
  }
  table.AddFault("name", fmt::format("is not a parameter of {}; it has {}{}", effect.id, names,
                                     names.find('#') == std::string::npos
                                         ? ""
                                         : fmt::format(" (# is a joint, 1..{})", joint_count)));
  return nullptr;
}

/// Adds faults if the parameter does not apply to a joint of this type, or states a wrong unit. The
/// unit of a revolute joint at a prismatic one, as models of earlier versions have it, is a
/// warning; both have the same factor to SI.
void CheckJointAndUnit(const TomlTable& table, const effects::EffectTraits& traits,
                       const effects::ParameterSpec& entry, model::EffectParameter& parameter,
                       int joint_count, std::uint32_t prismatic) {
  const int joint = effects::ParameterFromName(traits, parameter.name, joint_count)->joint;
  const bool slides = joint >= 0 && ((prismatic >> joint) & 1U) != 0;
  if (entry.only && joint >= 0 && slides != (*entry.only == model::JointType::kPrismatic)) {
    table.AddFault("name", fmt::format("applies to {} joints only, but q{} is {}",
                                       slides ? "revolute" : "prismatic", joint + 1,
                                       slides ? "prismatic" : "revolute"));
  }
  const std::string_view unit = UnitOf(entry, prismatic, joint);
  if (!table.Has("unit") || parameter.unit.empty() || parameter.unit == unit) return;
  if (slides && parameter.unit == entry.unit) {
    table.AddWarning("unit", fmt::format("is that of a revolute joint; the value of {} is taken in "
                                         "{}; write \"{}\"",
                                         parameter.name, unit, unit));
    parameter.unit = unit;
  } else {
    table.AddFault("unit", fmt::format("is not the unit of {}; write \"{}\"", entry.name, unit));
  }
}

model::EffectParameter ParameterFromToml(const TomlTable& table, const effects::Effect* effect,
                                         int joint_count, std::uint32_t prismatic) {
  model::EffectParameter parameter;
  parameter.name = table.RequiredString("name").value_or("");
  const bool checked = effect != nullptr && !parameter.name.empty();
  const effects::ParameterSpec* entry =
      checked ? SpecFromName(table, effect->traits(), parameter.name, joint_count) : nullptr;
  if (entry != nullptr && !entry->words.empty()) {
    parameter.word = WordFromToml(table, entry->words);
    return parameter;
  }
  parameter.value = table.RequiredNumber("value", kAnyNumber).value_or(0);
  if (entry != nullptr && entry->inverse && table.Has("value") && !(parameter.value > 0)) {
    table.AddFault("value", "must be greater than 0");
  }
  parameter.sd = table.Number("sd", kStandardDeviation);
  parameter.unit = table.String("unit").value_or("");
  if (entry == nullptr) return parameter;
  CheckJointAndUnit(table, effect->traits(), *entry, parameter, joint_count, prismatic);
  if (!table.Has("unit")) {
    const int joint =
        effects::ParameterFromName(effect->traits(), parameter.name, joint_count)->joint;
    parameter.unit = UnitOf(*entry, prismatic, joint);
  }
  return parameter;
}

/// Adds a fault if C is not a covariance matrix: asymmetric, or with a negative eigenvalue. Tested
/// on the correlation matrix, so that the scale of the parameters does not matter.
void CheckCovariance(const TomlTable& table, const Eigen::MatrixXd& C) {
  const auto n = C.rows();
  Eigen::VectorXd sd(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    if (C(i, i) < 0) {
      table.AddFault("covariance", fmt::format("has a negative variance in row {}", i + 1));
      return;
    }
    sd[i] = std::sqrt(C(i, i));
  }
  Eigen::MatrixXd correlation = Eigen::MatrixXd::Identity(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      const double scale = sd[i] * sd[j];
      if (std::abs(C(i, j) - C(j, i)) > kSymmetryTolerance * scale) {
        table.AddFault("covariance",
                       fmt::format("is not symmetric: row {} column {}", i + 1, j + 1));
        return;
      }
      // A covariance without variance is impossible; 2 makes the matrix indefinite.
      const double cosine = scale > 0 ? C(i, j) / scale : (C(i, j) == 0 ? 0.0 : 2.0);
      correlation(i, j) = correlation(j, i) = cosine;
    }
  }
  if (n == 0) return;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(correlation, Eigen::EigenvaluesOnly);
  if (!(solver.eigenvalues().minCoeff() >= -kEigenvalueTolerance)) {
    table.AddFault("covariance", "is not positive semidefinite");
  }
}

void ReadOrigin(const TomlTable& table, model::WrittenEffect& effect) {
  const auto from = table.Table("from");
  if (!from) return;
  effect.from_file = from->String("file").value_or("");
  effect.from_date = from->String("date").value_or("");
  effect.from_rows = from->Integer("rows", 0, 1000000000);
}

}  // namespace

model::WrittenEffect EffectFromToml(const TomlTable& table, int joint_count,
                                    std::uint32_t prismatic) {
  model::WrittenEffect effect;
  effect.id = table.RequiredString("id").value_or("");
  const effects::Effect* entry = effects::FindEffect(effect.id);
  if (entry == nullptr && !effect.id.empty()) {
    std::string ids;
    for (const effects::Effect* known : effects::Catalogue())
      ids += std::string(known->traits().id) + ", ";
    table.AddFault("id", "is not a known effect; known effects are " + ids +
                             std::string(effects::Empirical().traits().id));
  }
  effect.scope = table.Strings("scope").value_or(std::vector<std::string>{});
  for (const std::string& joint : effect.scope) {
    if (!effects::JointFromScope(joint, joint_count)) {
      table.AddFault("scope",
                     fmt::format("names \"{}\", which is not one of q1..q{}", joint, joint_count));
    }
  }
  if (!table.Has("parameters")) {
    table.AddMissing("parameters", "a list such as [ { name = \"q2\", value = 5.1e-7 } ]");
  }
  for (const TomlTable& parameter : table.Tables("parameters")) {
    model::EffectParameter read = ParameterFromToml(parameter, entry, joint_count, prismatic);
    const bool repeated = std::any_of(
        effect.parameters.begin(), effect.parameters.end(),
        [&read](const model::EffectParameter& other) { return other.name == read.name; });
    if (repeated && !read.name.empty()) parameter.AddFault("name", "is given twice");
    effect.parameters.push_back(std::move(read));
  }
  if (table.Has("covariance")) {
    const auto numbers = std::count_if(
        effect.parameters.begin(), effect.parameters.end(),
        [](const model::EffectParameter& parameter) { return parameter.word.empty(); });
    const int n = static_cast<int>(numbers);
    if (const auto covariance = table.Matrix("covariance", kAnyNumber, n, n)) {
      CheckCovariance(table, *covariance);
      effect.covariance = *covariance;
    }
  }
  if (entry != nullptr && entry->traits().empirical) {
    effect.drivers = table.Strings("drivers").value_or(std::vector<std::string>{});
    effect.nodes = table.Rows("nodes", kAnyNumber).value_or(Eigen::MatrixXd());
    const std::string fault =
        effects::EmpiricalFault(effect.drivers, effect.nodes, effect.parameters.size());
    if (!fault.empty()) table.AddFault("id", fault);
  }
  if (const auto seen = table.Numbers("seen_t_s", kAnyNumber, 2)) {
    if ((*seen)[0] > (*seen)[1])
      table.AddFault("seen_t_s", "has its lower end above its upper end");
    effect.seen_t_s = model::Interval{(*seen)[0], (*seen)[1]};
  }
  ReadOrigin(table, effect);
  return effect;
}

}  // namespace plumbline::config
