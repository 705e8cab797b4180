#include "app/measure/diagnosis/blocks.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "app/measure/diagnosis/legendre.h"
#include "firmware-like/effects/empirical.h"

namespace plumbline::measure {
namespace {

using I = effects::Influence<double>;

/// Plausible sizes of an empirical carrier, SI.
model::Interval PlausibleCarried(int entry) {
  if (entry == I::kBendRatio) return {-3, 3};
  if (entry < model::kMaxJoints) return {-0.02, 0.02};  // rotation of a joint [rad]
  return {-0.05, 0.05};  // length of a link, translation of base or tip [m]
}

/// True if the twist of link i is between two axes that are parallel to about a degree.
bool ParallelAxesAt(const model::Robot& robot, int i) {
  constexpr double kLeastSine = 0.02;
  const bool proximal = robot.convention == model::DhConvention::kProximal;
  const int other = proximal ? i - 1 : i + 1;
  if (other < 0 || other >= robot.size()) return false;
  const model::Joint& link = robot.joints[i];
  // z of one axis in the frame of the other: (sin beta, -sin alpha cos beta, cos alpha cos beta)
  return std::hypot(std::sin(link.beta_rad), std::sin(link.alpha_rad) * std::cos(link.beta_rad)) <
         kLeastSine;
}

}  // namespace

double BlockColumn::Largest() const {
  return std::max(std::abs(plausible.low), std::abs(plausible.high));
}

bool IsDeclared(const model::CellModel& cell, std::string_view id) {
  return std::ranges::any_of(cell.effects,
                             [&](const model::WrittenEffect& effect) { return effect.id == id; });
}

model::Interval PlausibleSizes(const effects::EffectTraits& traits, int spec, std::string_view word,
                               std::uint32_t prismatic, int joint) {
  const effects::ParameterSpec& parameter = traits.parameters[spec];
  const model::Interval range = effects::PlausibleOf(parameter, word, prismatic, joint);
  if (parameter.inverse) return {0, 1 / std::max(1e-9, range.low)};
  return {range.low * parameter.to_SI, range.high * parameter.to_SI};
}

bool SameColumns(const Block& a, const Block& b) {
  return a.id == b.id && a.term.word == b.term.word && a.term.parameters == b.term.parameters &&
         a.term.drivers == b.term.drivers &&
         std::equal(a.columns.begin(), a.columns.end(), b.columns.begin(), b.columns.end(),
                    [](const BlockColumn& x, const BlockColumn& y) {
                      return x.values == y.values && x.entry == y.entry && x.degree == y.degree &&
                             x.second_degree == y.second_degree;
                    });
}

namespace {

/// The parameters of one spec and one joint that exist on this arm.
void AddParameters(const model::Robot& robot, const effects::ParameterSpec& parameter, int spec,
                   int joint, std::vector<effects::TermParameter>& parameters) {
  const model::JointType type = robot.joints[joint].type;
  if (parameter.only.value_or(type) != type || (parameter.not_of_first && joint == 0)) return;
  if (parameter.parallel_axes_only && !ParallelAxesAt(robot, joint)) return;
  if (effects::IsOfTwoJoints(parameter)) {
    for (int inboard = 0; inboard < joint; ++inboard)
      parameters.push_back({spec, joint, 1, inboard});
  } else if (effects::IsOfJointAndLink(parameter)) {
    for (int link = joint; link < robot.size(); ++link) {
      parameters.push_back({spec, joint, 1, link});
    }
  } else {
    parameters.push_back({spec, joint});
  }
}

/// One column for each entry and pair of degrees in the two signals.
Block EmpiricalOf(const Dataset& data, SignalIndex first, std::optional<SignalIndex> second,
                  const std::vector<int>& entries, const std::vector<std::pair<int, int>>& degrees,
                  double trials) {
  Block block;
  block.term.effect = &effects::Empirical();
  block.id = block.term.effect->traits().id;
  block.term.drivers = {data.signals[first].column};
  if (second) block.term.drivers.push_back(data.signals[*second].column);
  for (const int entry : entries) {
    for (const auto& [a, b] : degrees) {
      BlockColumn& column = block.columns.emplace_back();
      column.entry = entry;
      column.signal = first;
      column.degree = a;
      column.second_signal = second;
      column.second_degree = b;
      column.plausible = PlausibleCarried(entry);
    }
  }
  block.trials = trials;
  return block;
}

}  // namespace

Block WholeBlock(const Dataset& data, const effects::Effect& effect, std::string_view word) {
  const effects::EffectTraits& traits = effect.traits();
  Block block;
  block.id = traits.id;
  block.term.effect = &effect;
  block.term.word = word;
  block.term.prismatic = effects::PrismaticJoints(data.cell.robot);
  for (int spec = 0; spec < static_cast<int>(traits.parameters.size()); ++spec) {
    const effects::ParameterSpec& parameter = traits.parameters[spec];
    if (parameter.role != effects::ParameterRole::kSize) continue;
    if (parameter.name.find('#') == std::string_view::npos) {
      block.term.parameters.push_back({spec});
      continue;
    }
    for (int joint = 0; joint < data.cell.robot.size(); ++joint) {
      AddParameters(data.cell.robot, parameter, spec, joint, block.term.parameters);
    }
  }
  const std::string_view sign_word = IsDeclared(data.cell, traits.id) ? std::string_view() : word;
  const bool independent_parameters = traits.per_joint || traits.independent_parameters;
  const std::size_t count = block.term.parameters.size();
  for (std::size_t k = 0; k < count; ++k) {
    BlockColumn& column = block.columns.emplace_back();
    column.unit = independent_parameters ? static_cast<int>(k) : 0;
    column.parameter = static_cast<int>(k);
    column.values.assign(count, 0.0);
    const effects::TermParameter& own = block.term.parameters[k];
    column.plausible = PlausibleSizes(traits, own.spec, sign_word, block.term.prismatic, own.joint);
  }
  block.units = independent_parameters ? static_cast<int>(count) : 1;
  return block;
}

bool HasContinuousShape(const Block& block) {
  const auto& specs = block.term.effect->traits().parameters;
  for (std::size_t k = 0; k < block.term.parameters.size(); ++k) {
    const effects::ParameterSpec& spec = specs[block.term.parameters[k].spec];
    // The sine and cosine columns represent the phase.
    if (spec.role != effects::ParameterRole::kShape || effects::IsEventTime(spec) ||
        spec.unit == "rad")
      continue;
    const double value = block.columns.front().values[k];
    if (!effects::IsCycles(spec) || value != std::round(value)) return true;
  }
  return false;
}

bool ActsFromEventTime(const effects::EffectTerm& term) {
  if (term.parameters.empty()) return false;
  const auto& specs = term.effect->traits().parameters;
  return effects::IsEventTime(specs[static_cast<std::size_t>(term.parameters.front().spec)]);
}

bool IsLinear(const effects::EffectTerm& term) {
  const auto& specs = term.effect->traits().parameters;
  return std::ranges::all_of(term.parameters, [&](const effects::TermParameter& own) {
    const effects::ParameterSpec& spec = specs[own.spec];
    return spec.role == effects::ParameterRole::kSize && !spec.inverse &&
           spec.value_of_linear == nullptr;
  });
}

bool RepeatsWithAngle(const effects::Effect& effect) {
  const auto& specs = effect.traits().parameters;
  return std::ranges::any_of(specs, effects::IsCycles);
}

std::optional<PeriodicLine> LineOf(const Block& block) {
  const auto& specs = block.term.effect->traits().parameters;
  for (std::size_t k = 0; k < block.term.parameters.size(); ++k) {
    const effects::TermParameter& parameter = block.term.parameters[k];
    if (!effects::IsCycles(specs[parameter.spec])) continue;
    return PeriodicLine{parameter.joint, block.columns.front().values[k], 0, 0};
  }
  return std::nullopt;
}

Block EmpiricalBlock(const Dataset& data, SignalIndex signal, const std::vector<int>& entries,
                     int degree, bool with_constant, double trials) {
  std::vector<std::pair<int, int>> degrees;
  for (int power = with_constant ? 0 : 1; power <= degree; ++power) degrees.emplace_back(power, 0);
  return EmpiricalOf(data, signal, std::nullopt, entries, degrees, trials);
}

Block EmpiricalSurface(const Dataset& data, SignalIndex first, SignalIndex second,
                       const std::vector<int>& entries, int degree, bool with_constant,
                       double trials) {
  return EmpiricalOf(data, first, second, entries, SurfaceDegrees(degree, with_constant), trials);
}

std::vector<std::pair<int, int>> SurfaceDegrees(int degree, bool with_constant) {
  std::vector<std::pair<int, int>> degrees;
  if (with_constant) degrees.emplace_back(0, 0);
  for (int sum = 1; sum <= degree; ++sum) {
    for (int b = 0; b <= sum; ++b) degrees.emplace_back(sum - b, b);
  }
  if (degree == 1) degrees.emplace_back(1, 1);
  return degrees;
}

double FactorOf(const Dataset& data, const BlockColumn& column, RowIndex row) {
  const auto factor = [&](SignalIndex index, int degree) {
    const RecordedSignal& signal = data.signals[index];
    return Legendre(degree, Scaled(signal, signal.values[row]));
  };
  const double first = factor(*column.signal, column.degree);
  return column.second_signal ? first * factor(*column.second_signal, column.second_degree) : first;
}

void ColumnsAt(const Dataset& data, const Linearisation& linear, const Block& block, RowIndex row,
               Eigen::Ref<Eigen::MatrixXd> out) {
  const Gradient& gradient = linear.gradients[row];
  if (block.empirical()) {
    for (const BlockColumnIndex k : block.columns.indices()) {
      const BlockColumn& column = block.columns[k];
      out.col(k.value()) = FactorOf(data, column, row) * gradient.col(column.entry);
    }
    return;
  }
  const bool alike = std::ranges::all_of(block.columns, [&](const BlockColumn& column) {
    return column.values == block.columns.front().values;
  });
  if (alike) {
    std::vector<int> which;
    for (const BlockColumn& column : block.columns) which.push_back(column.parameter);
    TermColumns(block.term, block.columns.front().values, which, data.conditions[row], gradient,
                out);
    return;
  }
  for (const BlockColumnIndex k : block.columns.indices()) {
    const std::array<int, 1> which = {block.columns[k].parameter};
    TermColumns(block.term, block.columns[k].values, which, data.conditions[row], gradient,
                out.middleCols<1>(k.value()));
  }
}

}  // namespace plumbline::measure
