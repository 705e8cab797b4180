#include "app/base/config/point_solutions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "app/base/config/out_of_range.h"
#include "firmware-like/correction/taught_tool.h"
#include "firmware-like/deflection/linear_range.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/loads/numbered_load.h"

namespace plumbline::config {
std::string BeyondLinearTheory(const model::CellModel& cell, const deflection::LoadedArm& arm,
                               const deflection::LoadedState& state) {
  std::string text;
  const double bend = deflection::BendShare(arm, state);
  if (bend > deflection::kLargestLinearBend) {
    text = fmt::format(
        "the tool bends by {:.3g} % of its length; linear beam theory holds up to {:g} % and "
        "neglects up to {:.3g} mm here, which an unmeasured radius includes. Use a stiffer tool or "
        "a lighter load, or measure at this load",
        100 * bend, 100 * deflection::kLargestLinearBend,
        kMmPerMetre * deflection::NeglectedByLinearTheory(arm, state));
  }
  const auto yield = deflection::YieldShare(cell.ToolAt(state.tool.payload.tool), state);
  if (yield && *yield > 1) {
    if (!text.empty()) text += "; ";
    text += fmt::format(
        "the stress in the tool is {:.0f} % of yield_MPa: it bends permanently, and no prediction "
        "holds. Reduce the load or use a stronger tool",
        100 * *yield);
  }
  return text;
}

namespace {

// Smaller corrections are below the repeatability of any industrial arm.
constexpr double kNoticeable_m = 5e-5, kNoticeableTurn_rad = 1e-4;

/// Same rule as in Machine: a mass needs a centre of gravity.
PointLoad LoadOf(std::string name, double mass_kg, const std::optional<Vec3>& cog_F) {
  if (mass_kg > 0 && !cog_F) return {std::move(name), std::nullopt};
  return {std::move(name), loads::Payload{mass_kg, cog_F.value_or(Vec3::Zero())}};
}

std::string LoadMassText(double mass_kg) {
  return fmt::format("{:.6g} kg", mass_kg);
}

std::vector<PointLoad> LoadsWithoutTool(const MachineConfig& config,
                                        const correction::AssemblyPoint& point) {
  using Source = PayloadPolicy::Source;
  const PayloadPolicy& policy = config.payload;
  const std::optional<Vec3>& cell_cog_F = config.cell.payload_cog_F;
  const auto cog_of = [&](const PayloadPolicy::ToolLoad& load) {
    return load.cog_F ? load.cog_F : cell_cog_F;
  };
  if (point.payload_kg) {
    const bool fixed = policy.source == Source::kFixed;
    return {LoadOf(LoadMassText(*point.payload_kg), *point.payload_kg,
                   cell_cog_F || !fixed ? cell_cog_F : policy.fixed.cog_F)};
  }
  std::vector<PointLoad> loads;
  switch (policy.source) {
    case Source::kFixed:
      loads.push_back(
          LoadOf(LoadMassText(policy.fixed.mass_kg), policy.fixed.mass_kg, cog_of(policy.fixed)));
      break;
    case Source::kTable:
      for (const PayloadPolicy::ToolLoad& tool : policy.table) {
        PointLoad load = LoadOf(fmt::format("tool {}, {}", tool.number, LoadMassText(tool.mass_kg)),
                                tool.mass_kg, cog_of(tool));
        const std::optional<int> index = loads::ToolIndexOf(config.cell, tool.number);
        if (load.payload && index) load.payload->tool = *index;
        if (!index) load.payload.reset();  // as in PayloadSelector
        loads.push_back(std::move(load));
      }
      break;
    case Source::kRobot:
      loads.push_back(LoadOf("no payload", 0, cell_cog_F));
      if (policy.fixed.mass_kg > 0) {
        loads.push_back(
            LoadOf(LoadMassText(policy.fixed.mass_kg), policy.fixed.mass_kg, cog_of(policy.fixed)));
      }
      break;
  }
  return loads;
}

}  // namespace

std::vector<PointLoad> LoadsOf(const MachineConfig& config,
                               const correction::AssemblyPoint& point) {
  const model::CellModel& cell = config.cell;
  std::vector<PointLoad> loads = LoadsWithoutTool(config, point);
  const bool by_table = config.payload.source == PayloadPolicy::Source::kTable && !point.payload_kg;
  if (cell.tools() == 1 || by_table) return loads;
  std::vector<int> tools(static_cast<std::size_t>(cell.tools()));
  std::iota(tools.begin(), tools.end(), 0);
  if (const auto taught = correction::TaughtTool(deflection::LoadedArm(cell), point)) {
    tools = {*taught};
  }
  std::vector<PointLoad> with_tools;
  for (const int tool : tools) {
    for (PointLoad load : loads) {
      if (load.payload) load.payload->tool = tool;
      const bool none = load.payload && load.payload->mass_kg == 0;
      load.name = fmt::format("tool {}, {}", cell.ToolAt(tool).number.value_or(0),
                              none ? std::string("0 kg") : load.name);
      with_tools.push_back(std::move(load));
    }
  }
  return with_tools;
}

model::JointVector SeedOf(const kinematics::Chain& chain, const correction::AssemblyPoint& point) {
  if (point.near_q) return *point.near_q;
  model::JointVector middle = 0.5 * (chain.lower() + chain.upper());
  for (int i = 0; i < chain.size(); ++i) {
    if (!std::isfinite(middle[i])) middle[i] = 0;
  }
  return middle;
}

std::string OrientationText(kinematics::Orientation orientation) {
  switch (orientation) {
    case kinematics::Orientation::kAxis:
      return "the arm takes any direction of the tool's axis; the turn about that axis follows "
             "from "
             "the position, and no correction changes it";
    case kinematics::Orientation::kNearest:
      return "the arm does not take every orientation: corrections hold the position exactly, and "
             "the orientation as nearly as the joints allow";
    default:
      return "";
  }
}

namespace {

/// What remains of the demanded orientation at a solved point.
std::string OrientationLeftText(kinematics::Orientation orientation, bool orientation_free,
                                const correction::Correction& correction) {
  if (orientation_free || orientation == kinematics::Orientation::kFixed ||
      correction.residual_rad < kNoticeableTurn_rad) {
    return "";
  }
  const double left_deg = correction.residual_rad / kRadPerDeg;
  return orientation == kinematics::Orientation::kAxis
             ? fmt::format(
                   "the turn about the tool's axis is {:.3g} deg from rpy_deg: this arm "
                   "cannot choose it",
                   left_deg)
             : fmt::format(
                   "the orientation is {:.3g} deg from rpy_deg: this arm cannot come nearer",
                   left_deg);
}

}  // namespace

std::vector<PointSolution> SolvePoints(const MachineConfig& config,
                                       const std::function<void(std::size_t)>& progress) {
  Machine machine(config);
  const correction::Corrector corrector(config.cell, config.limits);
  const deflection::LoadedArm& arm = corrector.arm();
  const kinematics::Orientation orientation = corrector.orientation();
  std::vector<PointSolution> solutions;
  for (std::size_t k = 0; k < config.points.size(); ++k) {
    if (progress) progress(k);
    const correction::AssemblyPoint& point = config.points[k];
    for (PointLoad& load : LoadsOf(config, point)) {
      PointSolution& solution = solutions.emplace_back();
      solution.point = k;
      solution.correction.code = correction::CorrectionCode::kPayloadUnknown;
      if (load.payload) {
        solution.correction = machine.Preview(point, *load.payload, SeedOf(machine.chain(), point),
                                              correction::BranchSearch::kThorough);
      }
      if (load.payload && solution.correction.code == correction::CorrectionCode::kOk) {
        deflection::LoadedState state;
        if (arm.AtCommanded(solution.correction.q, *load.payload, {}, state)) {
          solution.beyond_linear = BeyondLinearTheory(config.cell, arm, state);
        }
        solution.orientation_left =
            OrientationLeftText(orientation, point.orientation_free, solution.correction);
        solution.out_of_range = OutOfRangeText(config.cell, arm, solution.correction, *load.payload,
                                               machine.ConditionsOf(*load.payload));
      }
      if (solution.correction.q.size() > 0) {
        solution.posture =
            correction::PointPostureAt(machine.chain(), point, solution.correction.q);
      }
      solution.load = std::move(load);
    }
  }
  return solutions;
}

std::string PointFrameText(const model::CellModel& cell) {
  const model::Measurement& measurement = cell.measurement;
  if (measurement.holds_points) {
    return "the instrument's (measurement.points): base as fitted for the last session, tip as "
           "declared";
  }
  const bool fitted = !measurement.frame_known || !measurement.tool_known;
  return fmt::format("the cell's: base and tip as declared{}",
                     fitted ? ", not as fitted for measured sessions" : "");
}

std::string NothingCorrectedText(const MachineConfig& config,
                                 const std::vector<PointSolution>& solutions) {
  const PointSolution* most = nullptr;
  for (const PointSolution& solution : solutions) {
    if (solution.correction.code != correction::CorrectionCode::kOk) continue;
    if (solution.correction.rotation_B.norm() > kNoticeableTurn_rad) return "";
    if (most == nullptr ||
        solution.correction.translation_B.norm() > most->correction.translation_B.norm())
      most = &solution;
  }
  if (most == nullptr) return "";
  const double largest_m = most->correction.translation_B.norm();
  if (largest_m > kNoticeable_m) return "";
  const model::CellModel& cell = config.cell;
  const bool compliant =
      std::any_of(cell.robot.joints.begin(), cell.robot.joints.end(),
                  [](const model::Joint& j) { return j.compliance_rad_per_Nm.value_or(0) > 0; });
  return fmt::format(
      "nothing is corrected: the largest correction is {:.3f} mm (point {}), so that corrected "
      "points equal the taught ones. {}, and {}. Declare compliance_rad_per_Nm of the joints "
      "(typical values: cells/ur10-typical.toml), and the tool as a beam",
      largest_m / kMetrePerMm, config.points[most->point].id,
      compliant ? "The load does not turn the joints that have a compliance"
                : "The joints are rigid (no compliance_rad_per_Nm)",
      cell.any_tool_bends() ? "the tool does not bend: it is in the direction of gravity, or "
                              "nothing is at its tip"
                            : "the tool is rigid");
}

std::string FailureAdvice(const correction::Correction& correction,
                          const correction::CorrectionLimits& limits) {
  switch (correction.code) {
    case correction::CorrectionCode::kUnreachable:
      if (correction.residual_rad > limits.max_rotation_rad) {
        return fmt::format(
            "the arm reaches the position, but the nearest orientation that it can take there is "
            "{:.3g} deg from rpy_deg. Give one that it can take, or orientation = \"free\"",
            correction.residual_rad / kRadPerDeg);
      }
      return "no posture reaches it. Check the pose, its frame and the robot's base";
    case correction::CorrectionCode::kJointLimit:
      return "every posture that reaches it violates a joint limit. Check min_deg and max_deg, or "
             "move the station";
    case correction::CorrectionCode::kSingular:
      return fmt::format(
          "the smallest singular value {:.3g} is below correction.min_singular_value {:.3g}. Tilt "
          "the tool or move the station",
          correction.singular_value, limits.min_singular_value);
    case correction::CorrectionCode::kTooLarge:
      return fmt::format(
          "{:.1f} mm and {:.2f} deg exceed the limits of [correction]. Check payload, masses and "
          "compliances",
          correction.translation_B.norm() / kMetrePerMm, correction.rotation_B.norm() / kRadPerDeg);
    default:
      return "check payload, masses and compliances";
  }
}

}  // namespace plumbline::config
