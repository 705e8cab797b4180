#include "app/measure/diagnosis/linear/blocks.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "app/measure/diagnosis/linear/empirical_columns.h"
#include "app/measure/diagnosis/linear/shape_search.h"
#include "firmware-like/effects/empirical.h"
#include "firmware-like/effects/written.h"

namespace plumbline::measure {
namespace {

using I = effects::Influence<double>;
constexpr int kCurveNodes = 33;  // of an empirical curve
constexpr int kGridNodes = 9;    // along each driver of an empirical surface

std::string CarrierName(int entry, double& from_SI) {
  from_SI = 1;
  if (entry >= I::kBase && entry < I::kBase + 3) {
    from_SI = 1e3;
    return fmt::format("base_{}", "xyz"[entry - I::kBase]);
  }
  if (entry >= I::kTip && entry < I::kTip + 3) {
    from_SI = 1e3;
    return fmt::format("tip_{}", "xyz"[entry - I::kTip]);
  }
  if (entry == I::kBendRatio) return "tool_bending";
  if (entry == I::kBaseTilt || entry == I::kBaseTilt + 1)
    return fmt::format("tilt_{}", "xy"[entry - I::kBaseTilt]);
  const int joint = entry % model::kMaxJoints + 1;
  const int kind = entry / model::kMaxJoints;
  if (kind == I::kTurn) return fmt::format("q{}", joint);
  from_SI = 1e3;
  return fmt::format("{}{}", kind == I::kLengthA ? "a" : "d", joint);
}

/// Values of the drivers at the nodes of a curve or grid, evenly spaced over their ranges.
Eigen::MatrixXd DriversAtNodes(const Dataset& data, const BlockColumn& column) {
  const auto value = [&](SignalIndex index, int node, int count) {
    const RecordedSignal& signal = data.signals[index];
    return signal.low + (signal.high - signal.low) * node / (count - 1);
  };
  if (!column.second_signal) {
    Eigen::MatrixXd drivers(kCurveNodes, 1);
    for (int node = 0; node < kCurveNodes; ++node) {
      drivers(node, 0) = value(*column.signal, node, kCurveNodes);
    }
    return drivers;
  }
  Eigen::MatrixXd drivers(kGridNodes * kGridNodes, 2);
  for (int node = 0; node < drivers.rows(); ++node) {
    drivers(node, 0) = value(*column.signal, node / kGridNodes, kGridNodes);
    drivers(node, 1) = value(*column.second_signal, node % kGridNodes, kGridNodes);
  }
  return drivers;
}

effects::ActiveEffect EmpiricalEffect(const Dataset& data, const Block& block,
                                      const ColumnSizes& values) {
  const auto factor = [&](const BlockColumn& column,
                          const Eigen::Ref<const Eigen::RowVectorXd>& drivers) {
    const auto along = [&](SignalIndex index, int degree, double value) {
      return Legendre(degree, Scaled(data.signals[index], value));
    };
    const double first = along(*column.signal, column.degree, drivers[0]);
    return column.second_signal
               ? first * along(*column.second_signal, column.second_degree, drivers[1])
               : first;
  };
  std::vector<int> entries;
  for (const auto& [column, value] : values) {
    const int entry = block.columns[column].entry;
    if (std::ranges::find(entries, entry) == entries.end()) entries.push_back(entry);
  }
  model::WrittenEffect written;
  written.id = block.id;
  written.drivers = block.term.drivers;
  const Eigen::MatrixXd drivers = DriversAtNodes(data, block.columns.front());
  written.nodes.setZero(drivers.rows(), drivers.cols() + static_cast<int>(entries.size()));
  written.nodes.leftCols(drivers.cols()) = drivers;
  for (Eigen::Index node = 0; node < drivers.rows(); ++node) {
    for (std::size_t k = 0; k < entries.size(); ++k) {
      double from_SI = 1;
      CarrierName(entries[k], from_SI);
      double sum = 0;
      for (const auto& [column, value] : values) {
        const BlockColumn& fitted = block.columns[column];
        if (fitted.entry == entries[k]) sum += value * factor(fitted, drivers.row(node));
      }
      written.nodes(node, drivers.cols() + static_cast<int>(k)) = from_SI * sum;
    }
  }
  for (const int entry : entries) {
    double from_SI = 1;
    model::EffectParameter& parameter = written.parameters.emplace_back();
    parameter.name = CarrierName(entry, from_SI);
    parameter.value = 1;
    parameter.unit = "1";
  }
  return effects::ActiveFromWritten(written, data.cell);
}

}  // namespace

effects::ActiveEffect EffectFromSizes(const Block& block, const ColumnSizes& values) {
  effects::ActiveEffect effect;
  effect.term = block.term;
  effect.term.parameters.clear();
  const std::vector<double>& at = block.columns.front().values;
  const auto& specs = block.term.effect->traits().parameters;
  for (std::size_t k = 0; k < block.term.parameters.size(); ++k) {
    const effects::TermParameter& parameter = block.term.parameters[k];
    const auto column = std::ranges::find_if(
        block.columns, [&](const BlockColumn& c) { return c.parameter == static_cast<int>(k); });
    double size = at[k];
    if (column != block.columns.end()) {
      const auto value = values.find(BlockColumnIndex(column - block.columns.begin()));
      if (value == values.end()) continue;
      const effects::ParameterSpec& spec = specs[parameter.spec];
      size = spec.value_of_linear ? spec.value_of_linear(value->second) : value->second;
    }
    effect.term.parameters.push_back(parameter);
    effect.values.push_back(size);
  }
  return effect;
}

namespace {

/// The unit of each value of an effect that comes from one block.
std::vector<BlockUnit> UnitsOf(const Block& block, BlockIndex index,
                               const effects::ActiveEffect& effect) {
  std::vector<BlockUnit> units(effect.values.size(), BlockUnit{index, 0});
  if (block.units == 1) return units;
  for (std::size_t k = 0; k < units.size(); ++k) {
    const auto& parameters = block.term.parameters;
    const auto own = std::ranges::find(parameters, effect.term.parameters[k]);
    const auto column = std::ranges::find_if(block.columns, [&](const BlockColumn& of_effect) {
      return of_effect.parameter == static_cast<int>(own - parameters.begin());
    });
    if (column != block.columns.end()) units[k].number = column->unit;
  }
  return units;
}

}  // namespace

EffectsOfUnits EffectsAndUnits(const Dataset& data, const Indexed<BlockIndex, Block>& blocks,
                               const Coefficients& coefficients) {
  std::map<BlockIndex, ColumnSizes> by_block;
  for (const auto& [key, value] : coefficients) by_block[key.first][key.second] = value;
  EffectsOfUnits found;
  for (const auto& [index, values] : by_block) {
    const Block& block = blocks[index];
    if (block.empirical()) {
      found.effects.push_back(EmpiricalEffect(data, block, values));
      found.units.emplace_back();
      continue;
    }
    const ShapeSearch* search = ShapeSearchOf(*block.term.effect);
    effects::ActiveEffect effect =
        search != nullptr ? search->EffectFrom(block, values) : EffectFromSizes(block, values);
    std::vector<BlockUnit> units = UnitsOf(block, index, effect);
    const auto same = std::ranges::find_if(found.effects, [&](const effects::ActiveEffect& other) {
      return other.term.effect == effect.term.effect && other.term.word == effect.term.word &&
             search != nullptr && search->JoinsBlocks();
    });
    if (same != found.effects.end()) {
      search->Join(effect, *same);
      auto& joined = found.units[same - found.effects.begin()];
      joined.insert(joined.end(), units.begin(), units.end());
    } else {
      found.effects.push_back(std::move(effect));
      found.units.push_back(std::move(units));
    }
  }
  return found;
}

std::vector<effects::ActiveEffect> EffectsFrom(const Dataset& data,
                                               const Indexed<BlockIndex, Block>& blocks,
                                               const Coefficients& coefficients) {
  return EffectsAndUnits(data, blocks, coefficients).effects;
}

std::shared_ptr<const Eigen::MatrixXd> BlockColumns::Of(const Dataset& data,
                                                        const Linearisation& linear,
                                                        const Block& block, int threads) {
  const std::lock_guard lock(mutex_);
  const auto known = std::ranges::find_if(
      entries_, [&](const Entry& entry) { return SameColumns(entry.block, block); });
  if (known != entries_.end()) return known->columns;
  const auto width = static_cast<int>(block.columns.size());
  auto columns = std::make_shared<Eigen::MatrixXd>(linear.layout.total(), width);
  InParallel(data.rows(), threads, [&](int first, int last) {
    for (const RowIndex row : IndexRange(RowIndex(first), RowIndex(last))) {
      ColumnsAt(data, linear, block, row, linear.layout.PartOf(*columns, row));
    }
  });
  return entries_.emplace_back(Entry{block, std::move(columns)}).columns;
}

namespace {

using I = effects::Influence<double>;

/// Plausible sizes of an empirical carrier, SI.
model::Interval PlausibleCarried(int entry) {
  if (entry == I::kBendRatio) return {-3, 3};
  const bool tilts = entry == I::kBaseTilt || entry == I::kBaseTilt + 1;
  if (tilts || entry < model::kMaxJoints) return {-0.02, 0.02};  // rotation [rad]
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
