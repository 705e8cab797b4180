#include "app/diagnosis/candidates.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "firmware-like/effects/catalogue.h"

namespace plumbline {
namespace {

using I = Influence<double>;
constexpr int kCounterbalancedJoint = 1;  // q2 carries the spring or gas cylinder of heavy arms
constexpr int kCurveNodes = 33;           // of a written empirical curve

bool Has(const Dataset& data, Signal signal) {
  const RecordedColumns& recorded = data.table.recorded;
  switch (signal) {
    case Signal::kTime:
      return recorded.time;
    case Signal::kTemperature:
      return recorded.temperature && data.cell.measurement.reference_temperature_C.has_value();
    case Signal::kVelocity:
      return recorded.qd;
    case Signal::kAcceleration:
      return recorded.qdd;
    case Signal::kOrder:
      return recorded.order && data.rows() > 2;
    case Signal::kPayload:
      return recorded.payload && data.cell.payload_cog_F.has_value();
    case Signal::kTorques:
      return data.torques_known;
    case Signal::kBeam:
      return !data.cell.tool.rigid;
    case Signal::kCamera:
      return data.cell.measurement.X_WC.has_value();
  }
  return false;
}

const char* Lack(const Dataset& data, Signal signal) {
  switch (signal) {
    case Signal::kTime:
      return "t_s was not recorded";
    case Signal::kTemperature:
      return "temp_C was not recorded, or the cell names no reference_temperature_C";
    case Signal::kVelocity:
      return "qd was not recorded";
    case Signal::kAcceleration:
      return "qdd was not recorded";
    case Signal::kOrder:
      return data.table.recorded.order ? "too few rows for an order of execution"
                                       : "the robot's moves between the probes are not recorded";
    case Signal::kPayload:
      return "payload_kg was not recorded, or the cell has no [payload] cog_mm";
    case Signal::kTorques:
      return "link masses are not declared and torques not measured";
    case Signal::kBeam:
      return "the declared tool is rigid";
    case Signal::kCamera:
      return "no camera measures, or the cell names no camera_xyz_mm and camera_rpy_deg";
  }
  return "";
}

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

/// Every size of an effect, one column each; of per-joint effects for every joint that moved or
/// is loaded.
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

bool IsTwoPhases(const Block& block) {
  return block.id == "gear_periodic" || block.id == "counterbalance";
}

/// The stiffness ratio whose bending is the linear column's: 1/(1 + ratio) = 1 - coefficient.
double RatioFromBending(double coefficient) {
  constexpr double kSoftest = 0.05;
  return 1 / std::max(kSoftest, 1 - coefficient) - 1;
}

/// Joins harmonics: the second periodic term of a joint gets the specs of "q#_#_amplitude".
void JoinPeriodic(const ActiveEffect& more, ActiveEffect& effect) {
  constexpr int kSpecsOfFirst = 3;
  const int joint = more.term.parameters.front().joint;
  int harmonic = 1;
  for (const TermParameter& parameter : effect.term.parameters) {
    if (parameter.joint == joint) harmonic = std::max(harmonic, parameter.harmonic + 1);
  }
  for (std::size_t k = 0; k < more.values.size(); ++k) {
    TermParameter parameter = more.term.parameters[k];
    parameter.harmonic = harmonic;
    if (harmonic > 1) parameter.spec += kSpecsOfFirst;
    effect.term.parameters.push_back(parameter);
    effect.values.push_back(more.values[k]);
  }
}

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
  return fmt::format("q{}", entry % kMaxJoints + 1);
}

ActiveEffect EmpiricalEffect(const Dataset& data, const Block& block,
                             const std::map<int, double>& values) {
  const RecordedSignal& signal = data.signals[static_cast<std::size_t>(block.columns[0].signal)];
  std::vector<int> entries;
  for (const auto& [column, value] : values) {
    const int entry = block.columns[static_cast<std::size_t>(column)].entry;
    if (std::find(entries.begin(), entries.end(), entry) == entries.end()) entries.push_back(entry);
  }
  WrittenEffect written;
  written.id = "empirical";
  written.drivers = {signal.column};
  written.nodes.setZero(kCurveNodes, 1 + static_cast<int>(entries.size()));
  for (int node = 0; node < kCurveNodes; ++node) {
    const double u = signal.low + (signal.high - signal.low) * node / (kCurveNodes - 1);
    written.nodes(node, 0) = u;
    for (std::size_t k = 0; k < entries.size(); ++k) {
      double from_SI = 1;
      CarrierName(entries[k], from_SI);
      double sum = 0;
      for (const auto& [column, value] : values) {
        const BlockColumn& of = block.columns[static_cast<std::size_t>(column)];
        if (of.entry == entries[k]) sum += value * Legendre(of.degree, Scaled(signal, u));
      }
      written.nodes(node, 1 + static_cast<int>(k)) = from_SI * sum;
    }
  }
  for (const int entry : entries) {
    double from_SI = 1;
    EffectParameter& parameter = written.parameters.emplace_back();
    parameter.name = CarrierName(entry, from_SI);
    parameter.value = 1;
    parameter.unit = "1";
  }
  return ActiveFromWritten(written, data.cell);
}

}  // namespace

Candidates CandidatesFor(const Dataset& data) {
  Candidates candidates;
  for (const Effect* effect : Catalogue()) {
    const EffectTraits& traits = effect->traits();
    const std::string id(traits.id);
    if (id == "base_frame" && data.frames_free()) {
      candidates.not_offered.push_back({id, "the frame is unaligned: estimated anyway"});
      continue;
    }
    if (id == "tool_frame" && data.tip_free()) {
      candidates.not_offered.push_back({id, "the tool is unknown: estimated anyway"});
      continue;
    }
    const auto lacking = std::find_if(traits.needs.begin(), traits.needs.end(),
                                      [&](Signal signal) { return !Has(data, signal); });
    if (lacking != traits.needs.end()) {
      candidates.not_offered.push_back({id, Lack(data, *lacking)});
      continue;
    }
    // From the first row on it has nothing to search; from a moment on it has.
    if (id == "camera_zoom") candidates.searched.push_back(effect);
    if (id == "gear_periodic" || id == "thermal_drift" || id == "step_event") {
      candidates.searched.push_back(effect);
      continue;
    }
    if (id == "counterbalance") {
      const int amplitude = 0, phase = 1;
      if (data.cell.robot.size() > kCounterbalancedJoint) {
        candidates.blocks.push_back(
            TwoPhases(*effect, kCounterbalancedJoint, {{amplitude}, {phase}}, {0.0, 0.0}, phase));
      }
      continue;
    }
    std::vector<std::string_view> words = {""};
    for (const ParameterSpec& parameter : traits.parameters) {
      if (parameter.role != ParameterRole::kWord) continue;
      const auto comma = parameter.words.find(',');
      words = {parameter.words.substr(0, comma), parameter.words.substr(comma + 1)};
    }
    for (const std::string_view word : words) {
      const auto lacking_word = std::find_if(
          traits.word_needs.begin(), traits.word_needs.end(),
          [&](const WordNeed& need) { return need.word == word && !Has(data, need.signal); });
      if (lacking_word != traits.word_needs.end()) {
        candidates.not_offered.push_back(
            {fmt::format("{} ({})", id, word), Lack(data, lacking_word->signal)});
        continue;
      }
      candidates.blocks.push_back(WholeBlock(data, *effect, word));
    }
  }
  return candidates;
}

std::vector<Block> BlocksOf(const Dataset& data, const std::vector<ActiveEffect>& effects) {
  constexpr double kPeriodicTrials = 5000;  // as many as the search of all joints and cycles
  constexpr double kDriftTrials = 4;
  std::vector<Block> blocks;
  for (const ActiveEffect& effect : effects) {
    const EffectTraits& traits = effect.term.effect->traits();
    for (std::size_t k = 0; k < effect.values.size(); ++k) {
      const TermParameter& parameter = effect.term.parameters[k];
      const ParameterSpec& spec = traits.parameters[static_cast<std::size_t>(parameter.spec)];
      if (spec.role != ParameterRole::kShape) continue;
      if (traits.id == "gear_periodic" && spec.unit == "1/turn") {
        const bool whole = effect.values[k] == std::round(effect.values[k]);
        blocks.push_back(PeriodicBlock(parameter.joint, effect.values[k],
                                       whole ? data.cell.robot.size() : kPeriodicTrials));
      } else if (traits.id == "thermal_drift") {
        blocks.push_back(DriftBlock(effect.values[k], kDriftTrials));
      } else if (traits.id == "step_event") {
        blocks.push_back(StepBlock(data, effect.values[k], effect.term.word, data.rows()));
      } else if (traits.id == "camera_zoom") {
        blocks.push_back(ZoomBlock(data, effect.values[k], data.rows()));
      }
    }
  }
  return blocks;
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

double EffectsConsidered(const Dataset& data) {
  const auto catalogue = Catalogue();
  return static_cast<double>(
      std::count_if(catalogue.begin(), catalogue.end(), [&data](const Effect* effect) {
        return !effect->traits().Needs(Signal::kCamera) || Has(data, Signal::kCamera);
      }));
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

std::vector<ActiveEffect> EffectsFrom(const Dataset& data, const std::vector<Block>& blocks,
                                      const Coefficients& coefficients) {
  std::map<int, std::map<int, double>> by_block;
  for (const auto& [key, value] : coefficients) by_block[key.first][key.second] = value;
  std::vector<ActiveEffect> effects;
  for (const auto& [index, values] : by_block) {
    const Block& block = blocks[static_cast<std::size_t>(index)];
    if (block.empirical()) {
      effects.push_back(EmpiricalEffect(data, block, values));
      continue;
    }
    ActiveEffect effect;
    effect.term = block.term;
    if (IsTwoPhases(block)) {
      const auto sine = values.find(0), cosine = values.find(1);
      const double a = sine == values.end() ? 0 : sine->second;
      const double b = cosine == values.end() ? 0 : cosine->second;
      effect.values = block.columns[0].values;
      effect.values.front() = std::hypot(a, b);
      effect.values.back() = std::atan2(b, a);
    } else {
      // Sizes that were not kept go; shapes stay.
      const std::vector<double>& at = block.columns[0].values;
      effect.term.parameters.clear();
      for (std::size_t k = 0; k < block.term.parameters.size(); ++k) {
        const auto column =
            std::find_if(block.columns.begin(), block.columns.end(),
                         [&](const BlockColumn& c) { return c.parameter == static_cast<int>(k); });
        if (column == block.columns.end()) {
          effect.term.parameters.push_back(block.term.parameters[k]);
          effect.values.push_back(at[k]);
          continue;
        }
        const auto value = values.find(static_cast<int>(column - block.columns.begin()));
        if (value == values.end()) continue;
        effect.term.parameters.push_back(block.term.parameters[k]);
        effect.values.push_back(block.id == "tool_stiffness" ? RatioFromBending(value->second)
                                                             : value->second);
      }
    }
    const auto same = std::find_if(effects.begin(), effects.end(), [&](const ActiveEffect& other) {
      return other.term.effect == effect.term.effect && other.term.word == effect.term.word &&
             block.id == "gear_periodic";
    });
    if (same != effects.end()) {
      JoinPeriodic(effect, *same);
    } else {
      effects.push_back(std::move(effect));
    }
  }
  return effects;
}

double Legendre(int degree, double x) {
  double before = 1, now = x;
  if (degree == 0) return 1;
  for (int k = 1; k < degree; ++k) {
    const double next = ((2 * k + 1) * x * now - k * before) / (k + 1);
    before = now;
    now = next;
  }
  return now;
}

double Scaled(const RecordedSignal& signal, double value) {
  return 2 * (value - signal.low) / (signal.high - signal.low) - 1;
}

std::vector<std::string> ScopeOf(const EffectTerm& term) {
  std::set<int> joints;
  for (const TermParameter& parameter : term.parameters) {
    if (parameter.joint >= 0) joints.insert(parameter.joint);
  }
  std::vector<std::string> scope;
  scope.reserve(joints.size());
  for (const int joint : joints) scope.push_back(fmt::format("q{}", joint + 1));
  return scope;
}

}  // namespace plumbline
