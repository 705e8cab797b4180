#include "app/diagnosis/blocks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "app/diagnosis/legendre.h"
#include "firmware-like/effects/catalogue.h"

namespace plumbline {
namespace {

using I = Influence<double>;

/// The largest plausible size of a parameter, SI.
double Largest(const EffectTraits& traits, int spec) {
  const ParameterSpec& parameter = traits.parameters[static_cast<std::size_t>(spec)];
  const Interval& range = parameter.plausible;
  if (parameter.inverse) return 1 / std::max(1e-9, range.low);
  return std::max(std::abs(range.low), std::abs(range.high)) * parameter.to_SI;
}

/// The same of an empirical carrier.
double LargestCarried(int entry) {
  if (entry == I::kBendRatio) return 3;
  if (entry < kMaxJoints) return 0.02;  // of a joint's turn [rad]
  return 0.05;                          // of base or tip [m]
}

/// amplitude sin(cycles q + phase) as a sine and a cosine.
Block TwoPhases(const Effect& effect, int joint, std::vector<TermParameter> parameters,
                const std::vector<double>& values, int phase) {
  Block block;
  block.id = effect.traits().id;
  block.term.effect = &effect;
  block.term.parameters = std::move(parameters);
  for (TermParameter& parameter : block.term.parameters) parameter.joint = joint;
  for (const double angle : {0.0, std::numbers::pi / 2}) {
    BlockColumn& column = block.columns.emplace_back();
    column.values = values;
    column.values[static_cast<std::size_t>(phase)] = angle;
    column.largest = Largest(effect.traits(), block.term.parameters.front().spec);
  }
  return block;
}

}  // namespace

Block WholeBlock(const Dataset& data, const Effect& effect, std::string_view word) {
  const EffectTraits& traits = effect.traits();
  Block block;
  block.id = traits.id;
  block.term.effect = &effect;
  block.term.word = word;
  for (int spec = 0; spec < static_cast<int>(traits.parameters.size()); ++spec) {
    const ParameterSpec& parameter = traits.parameters[static_cast<std::size_t>(spec)];
    if (parameter.role != ParameterRole::kSize) continue;
    if (parameter.name.find('#') == std::string_view::npos) {
      block.term.parameters.push_back({spec});
      continue;
    }
    for (int joint = 0; joint < data.cell.robot.size(); ++joint) {
      block.term.parameters.push_back({spec, joint});
    }
  }
  const bool one_by_one = traits.per_joint || traits.id == "payload_mass";
  const std::size_t count = block.term.parameters.size();
  for (std::size_t k = 0; k < count; ++k) {
    BlockColumn& column = block.columns.emplace_back();
    column.unit = one_by_one ? static_cast<int>(k) : 0;
    column.parameter = static_cast<int>(k);
    column.values.assign(count, 0.0);
    column.largest = Largest(traits, block.term.parameters[k].spec);
  }
  block.units = one_by_one ? static_cast<int>(count) : 1;
  return block;
}

Block CounterbalanceBlock(const Effect& effect, int joint) {
  enum { kAmplitude, kPhase };
  return TwoPhases(effect, joint, {{kAmplitude}, {kPhase}}, {0.0, 0.0}, kPhase);
}

Block PeriodicBlock(int joint, double cycles, double trials) {
  enum { kAmplitude, kCycles, kPhase };
  Block block = TwoPhases(*FindEffect("gear_periodic"), joint, {{kAmplitude}, {kCycles}, {kPhase}},
                          {0.0, cycles, 0.0}, kPhase);
  block.trials = trials;
  return block;
}

Block DriftBlock(double time_constant_s, double trials) {
  Block block;
  block.id = "thermal_drift";
  block.term.effect = FindEffect(block.id);
  block.term.parameters = {{0}, {1}, {2}, {3}};
  for (int axis = 0; axis < 3; ++axis) {
    BlockColumn& column = block.columns.emplace_back();
    column.parameter = axis;
    column.values = {0, 0, 0, time_constant_s};
    column.largest = Largest(block.term.effect->traits(), axis);
  }
  block.trials = trials;
  return block;
}

Block StepBlock(const Dataset& data, double moment, std::string_view frame, double trials) {
  enum { kTime, kRow, kX };
  Block block;
  block.id = "step_event";
  block.term.effect = FindEffect(block.id);
  block.term.word = frame == "tool" ? "tool" : "base";
  block.term.parameters = {{data.table.recorded.time ? kTime : kRow}, {kX}, {kX + 1}, {kX + 2}};
  for (int axis = 0; axis < 3; ++axis) {
    BlockColumn& column = block.columns.emplace_back();
    column.parameter = 1 + axis;
    column.values = {moment, 0, 0, 0};
    column.largest = Largest(block.term.effect->traits(), kX + axis);
  }
  block.trials = trials;
  return block;
}

Block ZoomBlock(const Dataset& data, double moment, double trials) {
  enum { kTime, kRow, kScale };
  Block block;
  block.id = "camera_zoom";
  block.term.effect = FindEffect(block.id);
  block.term.parameters = {{data.table.recorded.time ? kTime : kRow}, {kScale}};
  BlockColumn& column = block.columns.emplace_back();
  column.parameter = 1;
  column.values = {moment, 0};
  column.largest = Largest(block.term.effect->traits(), kScale);
  block.trials = trials;
  return block;
}

bool BeginsAtAMoment(const EffectTerm& term) {
  if (term.parameters.empty()) return false;
  const auto& specs = term.effect->traits().parameters;
  return IsMoment(specs[static_cast<std::size_t>(term.parameters.front().spec)]);
}

Block EmpiricalBlock(const Dataset& data, int signal, const std::vector<int>& entries, int degree,
                     bool with_constant, double trials) {
  Block block;
  block.id = "empirical";
  block.term.effect = FindEffect(block.id);
  block.term.drivers = {data.signals[static_cast<std::size_t>(signal)].column};
  for (const int entry : entries) {
    for (int power = with_constant ? 0 : 1; power <= degree; ++power) {
      BlockColumn& column = block.columns.emplace_back();
      column.entry = entry;
      column.signal = signal;
      column.degree = power;
      column.largest = LargestCarried(entry);
    }
  }
  block.trials = trials;
  return block;
}

void ColumnsAt(const Dataset& data, const Linearisation& linear, const Block& block, int row,
               Eigen::Ref<Eigen::MatrixXd> out) {
  const auto at = static_cast<std::size_t>(row);
  const LinearRow& of = linear.rows[at];
  if (block.empirical()) {
    const RecordedSignal& signal = data.signals[static_cast<std::size_t>(block.columns[0].signal)];
    const double x = Scaled(signal, signal.values[at]);
    for (std::size_t k = 0; k < block.columns.size(); ++k) {
      out.col(static_cast<int>(k)) =
          Legendre(block.columns[k].degree, x) * of.dp.col(block.columns[k].entry);
    }
    return;
  }
  const bool alike = std::all_of(
      block.columns.begin(), block.columns.end(),
      [&](const BlockColumn& column) { return column.values == block.columns[0].values; });
  if (alike) {
    std::vector<int> which;
    for (const BlockColumn& column : block.columns) which.push_back(column.parameter);
    TermColumns(block.term, block.columns[0].values, which, data.conditions[at], of, out);
    return;
  }
  for (std::size_t k = 0; k < block.columns.size(); ++k) {
    const std::array<int, 1> which = {block.columns[k].parameter};
    TermColumns(block.term, block.columns[k].values, which, data.conditions[at], of,
                out.middleCols<1>(static_cast<int>(k)));
  }
}

}  // namespace plumbline
