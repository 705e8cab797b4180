// Where the target of a motion may lie: see rapid_values.h for the principle.
#include <fmt/format.h>

#include <array>
#include <cmath>

#include "app/programs/brands/rapid_values.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::programs::rapid {

namespace {

Target Computed(std::string_view expression) {
  constexpr std::size_t kMost = 80;
  Target target;
  target.computed = std::string(expression.substr(0, kMost));
  if (target.computed.empty()) target.computed = "(nothing)";
  return target;
}

/// Adds a displacement that is not known to a target.
void Unsettle(Target& target, const std::string& why) {
  if (target.point) target.offset = {Offset::In::kBase, {}, why};
}

}  // namespace

std::vector<Target> Values::TargetsOf(Range range, const Context& context) {
  std::vector<Target> targets = Follow(range, context);
  // Within a cycle of assignments, nothing is a value: what closes the cycle adds none.
  if (targets.empty() && visited_.empty()) {
    targets.push_back(Computed(range.empty() ? "" : range.file->Text(range.begin, range.end)));
  }
  return targets;
}

std::vector<Target> Values::Follow(Range range, const Context& context) {
  if (depth_ == 0) work_ = 20000;
  const NestingLevel level(depth_);
  const std::string_view text = range.empty() ? "" : range.file->Text(range.begin, range.end);
  if (range.empty() || level.too_deep() || --work_ < 0) return {Computed(text)};
  const TokenFile& file = *range.file;
  while (file.IsSign(range.begin, '(') && file.AfterBracket(range.begin) == range.end) {
    ++range.begin, --range.end;
  }
  if (range.empty()) return {Computed(text)};
  if (const auto point = declarations_.PointAt(file, range.begin);
      point && file.AfterBracket(range.begin) == range.end) {
    Target target;
    target.point = point;
    return {target};
  }
  if (!file.IsWord(range.begin)) return {Computed(text)};
  if (file.IsSign(range.begin + 1, '(') && file.AfterBracket(range.begin + 1) == range.end) {
    return TargetsOfCall(range, context);
  }
  const Designator designator = DesignatorAt(file, range.begin, range.end);
  if (designator.range.end != range.end) return {Computed(text)};
  if (context.instance != nullptr && designator.accessors.empty()) {
    const auto bound = context.instance->bound.find(designator.name);
    if (bound != context.instance->bound.end() && !bound->second.targets.empty()) {
      return bound->second.targets;
    }
  }
  if (const auto part = PartOf(designator, context)) return TargetsOfPart(*part, context);
  if (ParameterOf(designator.name, context) != nullptr) {
    return {Computed(fmt::format("{}, a parameter whose argument is not known", text))};
  }
  Target undeclared = Computed(text);
  undeclared.missing = "no file declares it; give the module that does";
  return {undeclared};
}

std::vector<Target> Values::TargetsOfCall(Range range, const Context& context) {
  const TokenFile& file = *range.file;
  const std::string name = Lowered(file.Text(range.begin));
  const Range arguments{&file, range.begin + 2, range.end - 1};
  const auto found = declarations_.FindRoutine(name, context.scope);
  if (!found) {
    if (name == "offs") return Displaced(arguments, false, context);
    if (name == "reltool") return Displaced(arguments, true, context);
    return {Computed(file.Text(range.begin, range.end))};
  }
  Instance instance;
  instance.routine = *found;
  const RoutineText& routine = declarations_.routines[*found];
  const auto given = ArgumentsOf(arguments);
  std::size_t required = 0;
  for (const Parameter& parameter : routine.parameters) {
    if (parameter.optional) continue;
    while (required < given.size() && !given[required].name.empty()) ++required;
    if (required >= given.size()) break;
    Binding binding;
    if (IsPointType(parameter.type) && parameter.dimensions == 0) {
      binding.targets = TargetsOf(given[required].value, context);
    } else {
      binding.number = ConstantOf(given[required].value, context);
    }
    instance.bound[parameter.name] = std::move(binding);
    ++required;
  }
  Context inside{routine.scope, &instance};
  inside.scope.routine = *found;
  std::vector<Target> targets;
  for (const Range& returned : routine.returns) {
    const auto more = TargetsOf(returned, inside);
    targets.insert(targets.end(), more.begin(), more.end());
    if (targets.size() > kMostValues) break;
  }
  if (targets.empty() || targets.size() > kMostValues) {
    return {Computed(file.Text(range.begin, range.end))};
  }
  return targets;
}

std::vector<Target> Values::Displaced(Range range, bool in_tool, const Context& context) {
  const auto arguments = ArgumentsOf(range);
  if (arguments.empty() || !arguments[0].name.empty()) return {Computed("Offs()")};
  std::vector<Target> targets = TargetsOf(arguments[0].value, context);
  Pose X;
  bool known = arguments.size() >= 4;
  std::array<double, 3> angles{};
  int turns = 0;
  for (std::size_t i = 1, axis = 0; i < arguments.size(); ++i) {
    const auto value = ConstantOf(arguments[i].value, context);
    known = known && value.has_value();
    if (!value) continue;
    const std::string& name = arguments[i].name;
    if (name.empty() && axis < 3) {
      X.p[static_cast<int>(axis++)] = *value * kMetrePerMm;
    } else if (name == "rx" || name == "ry" || name == "rz") {
      angles[static_cast<std::size_t>(name[1] - 'x')] = *value * kRadPerDeg;
      known = known && ++turns == 1;  // no source says in which order several are made
    } else {
      known = false;
    }
  }
  X.R = (Eigen::AngleAxisd(angles[0], Vec3::UnitX()) * Eigen::AngleAxisd(angles[1], Vec3::UnitY()) *
         Eigen::AngleAxisd(angles[2], Vec3::UnitZ()))
            .toRotationMatrix();
  const Offset::In in = in_tool ? Offset::In::kTool : Offset::In::kBase;
  for (Target& target : targets) {
    if (!target.point || !target.offset.unknown.empty()) continue;
    if (!known) {
      target.offset = {in, {}, "the displacement is computed at run time"};
    } else if (target.offset.in == Offset::In::kNone || target.offset.in == in) {
      target.offset.X = in_tool ? target.offset.X * X : X * target.offset.X;
      target.offset.in = in;
    } else {
      Unsettle(target, "Offs() and RelTool() are combined");
    }
  }
  return targets;
}

std::vector<Target> Values::TargetsOfPart(const Part& part, const Context& context) {
  const Data& data = declarations_.data[part.data];
  std::vector<Target> targets;
  const auto add = [&](const std::vector<Target>& more) {
    if (targets.size() <= kMostValues) targets.insert(targets.end(), more.begin(), more.end());
  };
  if (!IsTarget(part)) return {Computed(data.name)};
  // A variable that is computed from itself has moved by what is not known.
  if (!visited_.insert(part.data).second) return {};
  for (const Value* const value : ValuesOf(part)) {
    if (value->point) {
      Target target;
      target.point = value->point;
      add({target});
    } else if (!value->aggregate) {
      add(TargetsOf(value->range, {data.scope, nullptr}));
    } else {
      add({Computed(data.name)});
    }
  }
  std::string unsettled;
  for (const Assignment& one : data.assigned) {
    if (!MayBe(part, one)) continue;
    const std::string where = At(one.target.range.file->PlaceOf(one.target.range.begin));
    if (one.target.accessors.size() < part.steps.size()) {
      add({Computed(fmt::format("{}, assigned at {}", data.name, where))});
    } else if (one.target.accessors.size() > part.steps.size()) {
      unsettled = fmt::format("{} is changed at {}", data.name, where);
    } else {
      Context inside{declarations_.routines[one.routine].scope, nullptr};
      inside.scope.routine = one.routine;
      if (context.instance != nullptr && context.instance->routine == one.routine) {
        inside.instance = context.instance;
      }
      const auto more = TargetsOf(one.value, inside);
      if (more.empty()) unsettled = fmt::format("{} is moved at {}", data.name, where);
      add(more);
    }
  }
  visited_.erase(part.data);
  if (targets.empty() && visited_.empty()) add({Computed(data.name + ", which has no value")});
  if (targets.size() > kMostValues) return {Computed(data.name + ", which has too many values")};
  if (!unsettled.empty()) {
    for (Target& target : targets) Unsettle(target, unsettled);
  }
  return targets;
}

}  // namespace plumbline::programs::rapid
