#include "app/cell/model_store/point_moves.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "app/base/config/out_of_range.h"
#include "app/base/config/point_solutions.h"
#include "app/cell/model_store/model_store.h"
#include "firmware-like/correction/point_posture.h"
#include "firmware-like/correction/taught_tool.h"
#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/effects/catalogue.h"
#include "firmware-like/loads/numbered_load.h"

namespace plumbline::cell {
namespace {

struct Load {
  double mass_kg = 0;
  std::optional<Vec3> cog_F{};
  int tool = 0;  ///< index; the same in both models
};

/// One model of the arm, with the time for its time-dependent effects.
struct Model {
  Model(const model::CellModel& cell_model, const correction::CorrectionLimits& limits,
        double utc_s)
      : cell(deflection::CellOfPoints(cell_model)), corrector(cell, limits) {
    if (cell.domain && cell.domain->time_zero_s) t_s = utc_s - *cell.domain->time_zero_s;
  }

  correction::Correction Correct(const correction::AssemblyPoint& point, const Load& load,
                                 const model::JointVector& seed,
                                 correction::BranchSearch search) const {
    correction::Correction correction;
    if (load.mass_kg > 0 && !CogOf(load)) {
      correction.code = correction::CorrectionCode::kPayloadUnknown;
      return correction;
    }
    corrector.Correct(point, PayloadOf(load), ConditionsOf(load), seed, search, correction);
    return correction;
  }

  std::string OutOfRange(const correction::Correction& correction, const Load& load) const {
    return config::OutOfRangeText(cell, corrector.arm(), correction, PayloadOf(load),
                                  ConditionsOf(load));
  }

  std::optional<Vec3> CogOf(const Load& load) const {
    return load.cog_F ? load.cog_F : cell.payload_cog_F;
  }
  loads::Payload PayloadOf(const Load& load) const {
    loads::Payload payload{load.mass_kg, CogOf(load).value_or(Vec3::Zero())};
    payload.tool = load.tool;
    return payload;
  }
  effects::Conditions ConditionsOf(const Load& load) const {
    effects::Conditions conditions;
    conditions.payload_kg = load.mass_kg;
    conditions.t_s = t_s;
    return conditions;
  }

  const model::CellModel cell;
  correction::Corrector corrector;
  std::optional<double> t_s;
};

bool ReadsTemperature(const model::CellModel& cell) {
  return std::any_of(
      cell.effects.begin(), cell.effects.end(), [](const model::WrittenEffect& written) {
        const effects::Effect* const effect = effects::FindEffect(written.id);
        const bool follows = std::find(written.drivers.begin(), written.drivers.end(), "temp_C") !=
                             written.drivers.end();
        return follows ||
               (effect != nullptr && effect->traits().Needs(effects::Signal::kTemperature));
      });
}

/// The loads with the tool that was mounted when the point was taught, or with every tool if that
/// is not known.
std::vector<Load> WithTools(const std::vector<Load>& loads, const deflection::LoadedArm& arm,
                            const correction::AssemblyPoint& point) {
  const std::optional<int> taught = correction::TaughtTool(arm, point);
  std::vector<Load> with;
  for (int tool = taught.value_or(0); tool < (taught ? *taught + 1 : arm.tools()); ++tool) {
    for (Load load : loads) {
      load.tool = tool;
      with.push_back(load);
    }
  }
  return with;
}

/// The middle of each joint's limits; 0 for an unlimited joint.
model::JointVector MiddleOf(const model::Robot& robot) {
  model::JointVector q = model::JointVector::Zero(robot.size());
  for (int i = 0; i < robot.size(); ++i) {
    const model::Joint& joint = robot.joints[static_cast<std::size_t>(i)];
    if (std::isfinite(joint.min) && std::isfinite(joint.max)) q[i] = 0.5 * (joint.min + joint.max);
  }
  return q;
}

/// The loads to consider if the robot reports its load, each mass once.
std::vector<Load> ReportedLoads(const model::CellModel& before, const model::CellModel& after,
                                const std::vector<ReportedLoad>& reported) {
  std::vector<Load> loads;
  const auto add = [&loads](const Load& load) {
    const bool plausible = load.mass_kg >= 0 && load.mass_kg <= loads::kMaxPayload_kg;
    const bool known = std::any_of(loads.begin(), loads.end(), [&load](const Load& other) {
      return std::abs(other.mass_kg - load.mass_kg) < 1e-3;  // resolution of the register's float
    });
    if (plausible && !known) loads.push_back(load);
  };
  for (const ReportedLoad& load : reported) add({load.mass_kg, load.cog_F});
  add({0, std::nullopt});
  for (const model::CellModel* cell : {&before, &after}) {
    if (!cell->domain || !cell->domain->payload_kg) continue;
    add({std::max(0.0, cell->domain->payload_kg->Hull().low), std::nullopt});
    add({std::max(0.0, cell->domain->payload_kg->Hull().high), std::nullopt});
  }
  std::sort(loads.begin(), loads.end(),
            [](const Load& a, const Load& b) { return a.mass_kg < b.mass_kg; });
  return loads;
}

std::string ReportedNote(const std::vector<Load>& loads) {
  const std::string assumption =
      "the robot reports the load (payload.source = \"robot\"), so the configuration does not "
      "specify it: assumed to be ";
  if (loads.size() == 1 && loads[0].mass_kg == 0) {
    return assumption +
           "no load, because no other is known; with a load the points may move farther";
  }
  std::vector<double> masses_kg;
  for (const Load& load : loads) masses_kg.push_back(load.mass_kg);
  return fmt::format(
      "{}each of {:g} kg: no load, the loads it has reported, and the limits of the range that the "
      "models were fitted to; with another load the points may move farther",
      assumption, fmt::join(masses_kg, ", "));
}

/// Loads of points that have no payload of their own, from [payload].
std::vector<Load> ConfiguredLoads(const PayloadPolicy& policy, const model::CellModel& before,
                                  const model::CellModel& after,
                                  const std::vector<ReportedLoad>& reported,
                                  std::vector<std::string>& notes) {
  std::vector<Load> loads;
  switch (policy.source) {
    case PayloadPolicy::Source::kFixed:
      loads = {{policy.fixed.mass_kg, policy.fixed.cog_F}};
      break;
    case PayloadPolicy::Source::kTable:
      for (const auto& tool : policy.table) {
        const std::optional<int> index = loads::ToolIndexOf(before, tool.number);
        if (index) loads.push_back({tool.mass_kg, tool.cog_F, *index});
      }
      break;
    case PayloadPolicy::Source::kRobot:
      loads = ReportedLoads(before, after, reported);
      notes.push_back(ReportedNote(loads));
      break;
  }
  return loads;
}

/// The correction on the taught branch. A solution close to the taught joints is on it, and found
/// at once; the search for the nearest branch takes tens of milliseconds.
correction::Correction Taught(const Model& model, const correction::AssemblyPoint& point,
                              const Load& load, const model::JointVector& seed) {
  correction::Correction near = model.Correct(point, load, seed, correction::BranchSearch::kNone);
  if (near.code == correction::CorrectionCode::kOk && point.near_q &&
      !correction::PointPostureAt(model.corrector.arm().chain(), point, near.q).differs) {
    return near;
  }
  return model.Correct(point, load, seed, correction::BranchSearch::kThorough);
}

PointMove MoveOf(const correction::AssemblyPoint& point, const Load& load, const Model& before,
                 const Model& after) {
  PointMove move;
  move.id = point.id;
  move.name = point.name;
  move.payload_kg = load.mass_kg;
  if (before.cell.tools() > 1) move.tool_number = before.cell.ToolAt(load.tool).number;
  const model::JointVector seed = point.near_q.value_or(MiddleOf(before.cell.robot));
  const correction::Correction first = Taught(before, point, load, seed);
  move.code_before = first.code;
  correction::Correction second;
  if (first.code ==
      correction::CorrectionCode::kOk) {  // stay on the same branch, as the running daemon does
    second = after.Correct(point, load, first.q, correction::BranchSearch::kNone);
  }
  if (second.code != correction::CorrectionCode::kOk) {
    second = Taught(after, point, load, seed);
  }
  move.code_after = second.code;
  move.before_B = first.X_BP_command.p;
  move.after_B = second.X_BP_command.p;
  if (before.cell.domain && after.cell.domain && !first.extrapolated) {
    move.leaves_range = after.OutOfRange(second, load);
  }
  return move;
}

/// The loads of one point: its own payload or the configured ones, with the tools.
std::vector<Load> LoadsAt(const correction::AssemblyPoint& point, const PayloadPolicy& policy,
                          const std::vector<Load>& configured, const Model& before,
                          const Model& after) {
  if (!point.payload_kg && policy.source == PayloadPolicy::Source::kTable) return configured;
  const bool by_policy = policy.source == PayloadPolicy::Source::kFixed &&
                         !before.cell.payload_cog_F && !after.cell.payload_cog_F;
  const std::vector<Load> own{
      {point.payload_kg.value_or(0), by_policy ? policy.fixed.cog_F : std::nullopt}};
  return WithTools(point.payload_kg ? own : configured, before.corrector.arm(), point);
}

std::string PointText(const PointMove& move) {
  return fmt::format("point {} ({}) at {:g} kg{}", move.id, move.name, move.payload_kg,
                     move.tool_number ? fmt::format(" with tool {}", *move.tool_number) : "");
}

/// "point 2 (roof) at 60 kg would lose its correction: out of reach"; empty without an objection.
std::string ObjectionTo(const PointMove& move, const std::optional<double>& explained_m) {
  if (move.code_before == correction::CorrectionCode::kOk && !move.Compared()) {
    return fmt::format("{} would lose its correction: {}", PointText(move),
                       Describe(move.code_after));
  }
  if (!move.Compared()) return {};
  if (explained_m && move.Distance_m() > kMovePerResidual * *explained_m) {
    return fmt::format(
        "{} would move by {:.3f} mm, more than {:g} times the largest residual that the model "
        "explains ({:.3f} mm)",
        PointText(move), 1e3 * move.Distance_m(), kMovePerResidual, 1e3 * *explained_m);
  }
  if (move.leaves_range.empty()) return {};
  return fmt::format("{} would be outside the range that its model was fitted to: {}",
                     PointText(move), move.leaves_range);
}

std::string PositionText(correction::CorrectionCode code, const Vec3& p_B) {
  if (code != correction::CorrectionCode::kOk) return "none";
  return fmt::format("{:.2f}, {:.2f}, {:.2f}", 1e3 * p_B.x(), 1e3 * p_B.y(), 1e3 * p_B.z());
}

}  // namespace

const PointMove* PointMoves::Largest() const {
  const PointMove* largest = nullptr;
  for (const PointMove& move : all) {
    if (!move.Compared()) continue;
    if (largest == nullptr || move.Distance_m() > largest->Distance_m()) largest = &move;
  }
  return largest;
}

std::vector<std::string> Objections(const PointMoves& moves) {
  constexpr std::size_t kMost = 5;
  std::vector<std::string> objections;
  for (const PointMove& move : moves.all) {
    std::string objection = ObjectionTo(move, moves.explained_m);
    if (!objection.empty()) objections.push_back(std::move(objection));
  }
  return Abbreviated(std::move(objections), kMost);
}

PointMoves ComputePointMoves(const MachineConfig& config, const model::CellModel& before,
                             const model::CellModel& after, double utc_s,
                             const std::vector<ReportedLoad>& reported,
                             const std::function<void()>& step, const std::stop_token& stop) {
  PointMoves moves;
  moves.frame = config::PointFrameText(after);
  for (const model::CellModel* const cell : {&before, &after}) {
    if (!cell->domain || !cell->domain->largest_residual_m) continue;
    moves.explained_m = std::max(moves.explained_m.value_or(0), *cell->domain->largest_residual_m);
  }
  const bool same_joints = before.robot.size() == after.robot.size();
  if (!same_joints || before.tools() != after.tools()) {
    moves.notes.push_back(
        fmt::format("the two models have different numbers of {}: no point can be compared",
                    same_joints ? "tools" : "joints"));
    return moves;
  }
  const Model model_before(before, config.limits, utc_s), model_after(after, config.limits, utc_s);
  const bool all_have_own = std::all_of(
      config.points.begin(), config.points.end(),
      [](const correction::AssemblyPoint& point) { return point.payload_kg.has_value(); });
  std::vector<Load> configured;
  if (!all_have_own) {
    configured = ConfiguredLoads(config.payload, before, after, reported, moves.notes);
  }
  std::vector<int> without_posture;
  for (const correction::AssemblyPoint& point : config.points) {
    const bool fits = !point.near_q || point.near_q->size() == before.robot.size();
    if (!fits) continue;  // a fault of the configuration, reported when it is read
    if (!point.near_q) without_posture.push_back(point.id);
    for (const Load& load : LoadsAt(point, config.payload, configured, model_before, model_after)) {
      if (stop.stop_requested()) return moves;
      if (step) step();
      moves.all.push_back(MoveOf(point, load, model_before, model_after));
    }
  }
  if (!without_posture.empty()) {
    moves.notes.push_back(fmt::format(
        "point{} {} without near_deg: computed for the posture nearest to the middle of the joint "
        "limits; in another posture the displacement differs",
        without_posture.size() == 1 ? "" : "s", fmt::join(without_posture, ", ")));
  }
  if (ReadsTemperature(before) || ReadsTemperature(after)) {
    moves.notes.emplace_back("temperature effects are left out: the temperature is not known here");
  }
  return moves;
}

std::string TextOf(const PointMoves& moves, const std::string& configuration) {
  std::string text;
  const bool tools = std::any_of(moves.all.begin(), moves.all.end(), [](const PointMove& move) {
    return move.tool_number.has_value();
  });
  if (!moves.all.empty()) {
    text += fmt::format("the points' frame is {}\n", moves.frame);
    text += fmt::format("corrected commands of the points of {}, in the robot's base, mm:\n",
                        configuration);
    text += fmt::format("{:>5} {:>7} {:>27} {:>27} {:>8}{}\n", "point", "load kg", "now", "then",
                        "moves", tools ? " tool" : "");
  }
  for (const PointMove& move : moves.all) {
    text += fmt::format("{:>5} {:>7g} {:>27} {:>27} {:>8}{}\n", move.id, move.payload_kg,
                        PositionText(move.code_before, move.before_B),
                        PositionText(move.code_after, move.after_B),
                        move.Compared() ? fmt::format("{:.3f}", 1e3 * move.Distance_m()) : "-",
                        tools ? fmt::format(" {:>4}", move.tool_number.value_or(0)) : "");
  }
  for (const PointMove& move : moves.all) {
    for (const auto& [code, when] :
         {std::pair(move.code_before, "now"), std::pair(move.code_after, "then")}) {
      if (code == correction::CorrectionCode::kOk) continue;
      text += fmt::format("{} has no correction {}: {}\n", PointText(move), when, Describe(code));
    }
  }
  if (const PointMove* const largest = moves.Largest()) {
    text += fmt::format("the largest move of a configured point is {:.3f} mm: {}\n",
                        1e3 * largest->Distance_m(), PointText(*largest));
  } else {
    text += fmt::format("how far the points of {} move is not known: none can be compared\n",
                        configuration);
  }
  for (const std::string& note : moves.notes) text += fmt::format("note: {}\n", note);
  return text;
}

}  // namespace plumbline::cell
