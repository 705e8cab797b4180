#include "app/base/config/out_of_range.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <vector>

#include "app/base/config/carried_numbers.h"
#include "firmware-like/deflection/uncertainty.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline::config {
namespace {

/// "q5 is 12.3 deg, measured: -10 to 8.2 deg"
std::string Text(const std::string& what, double value, const model::Interval& range, double to_SI,
                 std::string_view unit) {
  return fmt::format("{} {:.4g} {}, measured: {:.4g} to {:.4g} {}", what, value / to_SI, unit,
                     range.low / to_SI, range.high / to_SI, unit);
}

/// "0.71 q2 + 0.71 q3"
std::string SumText(const model::JointVector& weights) {
  std::string text;
  for (Eigen::Index k = 0; k < weights.size(); ++k) {
    if (std::abs(weights[k]) < 5e-3) continue;
    const char* const sign = weights[k] < 0 ? (text.empty() ? "-" : " - ")
                             : text.empty() ? ""
                                            : " + ";
    text += fmt::format("{}{:.2f} q{}", sign, std::abs(weights[k]), k + 1);
  }
  return text;
}

std::string Text(const model::CellModel& cell, const deflection::DomainExit& exit, int tool,
                 int item) {
  using Input = deflection::DomainExit::Input;
  const auto joint = [&] { return fmt::format("q{}", exit.index + 1); };
  const auto type = [&] { return cell.robot.joints[exit.index].type; };
  switch (exit.input) {
    case Input::kJoint: {
      const auto form = model::PositionForm(type());
      return Text(joint() + " is", exit.value, exit.range, form.to_SI, form.unit);
    }
    case Input::kJointCombination:
      return Text(SumText(cell.domain->combinations[exit.index].weights) + " is", exit.value,
                  exit.range, kRadPerDeg, "deg");
    case Input::kJointLoad:
      return Text(joint() + " carries", exit.value, exit.range, 1,
                  type() == model::JointType::kPrismatic ? "N" : "N m");
    case Input::kPayload:
      return Text("the payload is", exit.value, exit.range, 1, "kg");
    case Input::kPayloadLevel:
      return fmt::format("the payload is {:g} kg, measured: only {:g} and {:g} kg", exit.value,
                         exit.range.low, exit.range.high);
    case Input::kTemperature:
      return Text("the temperature is", exit.value, exit.range, 1, "degC");
    case Input::kTime:
      return Text(fmt::format("the time of {} is", cell.effects[exit.index].id), exit.value,
                  exit.range, 1, "s");
    case Input::kTool:
      return UnmeasuredToolText(cell, tool);
    case Input::kItem:
      return UnmeasuredItemText(cell, item);
  }
  return {};
}

}  // namespace

std::string OutOfRangeText(const model::CellModel& cell, const deflection::LoadedArm& arm,
                           const correction::Correction& correction, const loads::Payload& payload,
                           const effects::Conditions& conditions) {
  if (correction.code != correction::CorrectionCode::kOk || !correction.extrapolated) return {};
  std::vector<std::string> texts;
  if (arm.LacksColumn(conditions)) {
    texts.emplace_back(
        "a signal that an effect depends on is not reported, such as the temperature");
  }
  deflection::LoadedState state;
  if (!arm.AtCommanded(correction.q, payload, conditions, state)) return {};
  for (const deflection::DomainExit& exit :
       deflection::DomainExits(cell, {.q = correction.q,
                                     .payload_kg = payload.mass_kg,
                                     .temp_C = conditions.temp_C,
                                     .t_s = conditions.t_s,
                                     .tool = payload.tool,
                                     .item = payload.item,
                                     .tau = state.tau})) {
    texts.push_back(Text(cell, exit, payload.tool, payload.item));
  }
  return fmt::format("{}", fmt::join(texts, "; "));
}

}  // namespace plumbline::config
