#include "app/base/config/out_of_range.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <vector>

#include "app/base/config/carried_numbers.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline::config {
namespace {

/// "q5 is 12.3 deg, measured: -10 to 8.2 deg"
std::string Text(const std::string& what, double value, const model::Interval& range, double to_SI,
                 std::string_view unit, const char* range_name = "measured") {
  return fmt::format("{} {:.4g} {}, {}: {} {}", what, value / to_SI, unit, range_name,
                     range.low == range.high
                         ? fmt::format("only {:.4g}", range.low / to_SI)
                         : fmt::format("{:.4g} to {:.4g}", range.low / to_SI, range.high / to_SI),
                     unit);
}

}  // namespace

std::string ExitText(const model::CellModel& cell, const deflection::DomainExit& exit, int tool,
                     int item) {
  using Input = deflection::DomainExit::Input;
  const auto joint = [&] { return fmt::format("q{}", exit.index + 1); };
  const auto type = [&] { return cell.robot.joints[exit.index].type; };
  switch (exit.input) {
    case Input::kJoint: {
      const auto form = model::PositionForm(type());
      return Text(joint() + " is", exit.value, exit.range, form.to_SI, form.unit,
                  cell.domain ? "measured" : "limits");
    }
    case Input::kPosture:
      return fmt::format(
          "the posture is {:.0f} deg from the nearest measured one (measured: within {:.0f} deg)",
          exit.value / kRadPerDeg, exit.range.high / kRadPerDeg);
    case Input::kTorque:
      return Text(fmt::format("the gravity torque of {} is", joint()), exit.value, exit.range, 1,
                  type() == model::JointType::kPrismatic ? "N" : "N m");
    case Input::kPayload:
      return Text("the payload is", exit.value, exit.range, 1, "kg");
    case Input::kLoadUnrecorded:
      return fmt::format("the payload is {:.4g} kg, but the measured rows did not record theirs",
                         exit.value);
    case Input::kTemperature:
      return Text("the temperature is", exit.value, exit.range, 1, "degC");
    case Input::kTime:
      return Text("the time is", exit.value, exit.range, 1, "s");
    case Input::kTimeUnknown:
      return "the time is not known (time_zero_utc), although the error grows with it";
    case Input::kTool:
      return UnmeasuredToolText(cell, tool);
    case Input::kItem:
      return UnmeasuredItemText(cell, item);
  }
  return {};
}

std::string OutOfRangeText(const model::CellModel& cell, const deflection::LoadedArm& arm,
                           const correction::Correction& correction, const loads::Payload& payload,
                           const effects::Conditions& conditions) {
  if (correction.code != correction::CorrectionCode::kOk || !correction.extrapolated) return {};
  std::vector<std::string> texts;
  if (arm.LacksColumn(conditions)) {
    texts.emplace_back(
        "a signal that an effect depends on is not reported, such as the temperature");
  }
  const deflection::OperatingPoint point = arm.PointAt(correction.q, payload, conditions);
  for (const deflection::DomainExit& exit : arm.growth().Exits(point)) {
    texts.push_back(ExitText(cell, exit, payload.tool, payload.item));
  }
  return fmt::format("{}", fmt::join(texts, "; "));
}

}  // namespace plumbline::config
