// Calls in a routine of RAPID, and points that are used other than as targets.
#include <optional>

#include "app/programs/brands/rapid_body.h"

namespace plumbline::programs::rapid {

void Body::CallLate(Range statement) {
  std::size_t close = statement.begin + 1;
  while (close < statement.end && !file_.IsSign(close, '%')) ++close;
  const auto arguments = ArgumentsOf({&file_, std::min(close + 1, statement.end), statement.end});
  lowering_.Remark(place_, "a routine is called whose name is known only at run time");
  // `%"weld"+ValToStr(n)%` calls one of the routines whose names start so.
  if (file_[statement.begin + 1].kind == TokenKind::kText) {
    std::string_view start = file_.Text(statement.begin + 1);
    start.remove_prefix(1);
    if (!start.empty() && start.back() == '"') start.remove_suffix(1);
    const bool whole = close == statement.begin + 2;
    constexpr std::size_t kMostCandidates = 100;
    std::size_t candidates = 0;
    for (std::size_t i = 0; i < lowering_.declarations_.routines.size() && !start.empty(); ++i) {
      const RoutineText& routine = lowering_.declarations_.routines[i];
      if (routine.trap || !routine.type.empty() || !StartsWithWord(routine.name, start) ||
          (whole && routine.name.size() != start.size()) || ++candidates > kMostCandidates) {
        continue;
      }
      const std::string next = NewLabel();
      Branch(next);
      Call(i, arguments, place_);
      Label(next);
    }
  }
  for (const Argument& argument : arguments) {
    UseAll(argument.value, "passed to a routine whose name is known only at run time");
  }
  CallMissing(std::string(file_.Text(statement.begin, std::min(close + 1, statement.end))));
  MayFail();
}

Binding Body::BindingOf(const Parameter& parameter, const RoutineText& routine, Range value) {
  Binding binding;
  if (value.empty()) return binding;
  const Place place = file_.PlaceOf(value.begin);
  const std::string changed = fmt::format("{} assigns to it", routine.name);
  if (IsPointType(parameter.type) && parameter.dimensions == 0) {
    UseBesideTarget(value);
    binding.targets = values_.TargetsOf(value, context_);
    if (parameter.assigned) UseTargets(binding.targets, place, changed);
    return binding;
  }
  if (IsFrameType(parameter.type) && parameter.dimensions == 0) {
    binding.setting = values_.SettingOf(value, parameter.type, context_);
    if (parameter.assigned && parameter.by_reference) values_.Changed(*binding.setting, changed);
    if (parameter.assigned && !parameter.by_reference) *binding.setting = {"", changed};
    return binding;
  }
  if (file_.IsWord(value.begin)) {
    const Designator designator = DesignatorAt(file_, value.begin, value.end);
    if (designator.range.end == value.end) {
      binding.part = values_.PartOf(designator, context_);
      const auto bound = context_.instance->bound.find(designator.name);
      if (bound != context_.instance->bound.end()) binding.word = bound->second.word;
      if (file_.IsWord(value.begin, "fine")) binding.word = "fine";
    }
  }
  binding.number = values_.ConstantOf(value, context_);
  if (binding.number && !parameter.assigned) binding.part.reset();
  if (parameter.assigned) binding.number.reset();
  const bool points = binding.part && lowering_.declarations_.HoldsPoints(parameter.type);
  if (points && parameter.assigned) {
    for (const std::size_t point : values_.PointsIn(*binding.part)) {
      lowering_.Use(point, place, changed, steps_);
    }
  }
  const bool zone = parameter.type == "zonedata";
  if (!points) {
    UseAll(value, "its value is used in a calculation");
    if (!zone) binding.part.reset();
  }
  return binding;
}

void Body::Call(std::size_t index, const std::vector<Argument>& arguments, const Place& place) {
  const RoutineText& routine = lowering_.declarations_.routines[index];
  Instance instance;
  instance.routine = index;
  std::size_t required = 0;
  for (const Parameter& parameter : routine.parameters) {
    if (parameter.optional) {
      const Argument* const given = Optional(arguments, parameter.name);
      if (given != nullptr) {
        instance.bound[parameter.name] = BindingOf(parameter, routine, given->value);
      }
      continue;
    }
    while (required < arguments.size() && !arguments[required].name.empty()) ++required;
    if (required >= arguments.size()) break;
    instance.bound[parameter.name] = BindingOf(parameter, routine, arguments[required++].value);
  }
  const auto bound = instance.bound;
  const std::string label = lowering_.Request(std::move(instance));
  if (!label.empty()) {
    Add(StepKind::kCall, place, label);
  } else {
    for (const auto& [name, binding] : bound) {
      UseTargets(binding.targets, place, fmt::format("passed to {}", routine.name));
      if (!binding.part) continue;
      for (const std::size_t point : values_.PointsIn(*binding.part)) {
        lowering_.Use(point, place, fmt::format("passed to {}", routine.name), steps_);
      }
    }
    Add(StepKind::kCall, place, routine.name);
  }
  MayFail();
}

void Body::UseTargets(const std::vector<Target>& targets, const Place& place,
                      const std::string& reason) {
  for (const Target& target : targets) {
    if (target.point) lowering_.Use(*target.point, place, reason, steps_);
  }
}

void Body::UseBesideTarget(Range range) {
  constexpr const char* kCalculation = "its value is used in a calculation";
  while (!range.empty() && file_.IsSign(range.begin, '(') &&
         file_.AfterBracket(range.begin) == range.end) {
    ++range.begin, --range.end;
  }
  if (range.empty() || lowering_.declarations_.PointAt(file_, range.begin)) return;
  const NestingLevel level(depth_);
  const bool call = file_.IsWord(range.begin) && file_.IsSign(range.begin + 1, '(') &&
                    file_.AfterBracket(range.begin + 1) == range.end;
  if (call && !level.too_deep()) {
    const std::string name = Lowered(file_.Text(range.begin));
    const auto arguments = ArgumentsOf({&file_, range.begin + 2, range.end - 1});
    const auto routine = lowering_.declarations_.FindRoutine(name, context_.scope);
    if (routine) {
      Call(*routine, arguments, file_.PlaceOf(range.begin));
      return;
    }
    const bool displaced = name == "offs" || name == "reltool";
    for (std::size_t i = 0; i < arguments.size(); ++i) {
      if (displaced && i == 0) {
        UseBesideTarget(arguments[i].value);
      } else {
        UseAll(arguments[i].value, kCalculation);
      }
    }
    return;
  }
  const Designator designator = DesignatorAt(file_, range.begin, range.end);
  if (!file_.IsWord(range.begin) || designator.range.end != range.end) {
    UseAll(range, kCalculation);
    return;
  }
  for (const Accessor& accessor : designator.accessors) {
    if (accessor.field.empty()) UseAll(accessor.index, kCalculation);
  }
}

void Body::UseAll(Range range, const std::string& reason) {
  const NestingLevel level(depth_);
  for (std::size_t i = range.begin; i < range.end;) {
    if (const auto point = lowering_.declarations_.PointAt(file_, i)) {
      lowering_.Use(*point, file_.PlaceOf(i), reason, steps_);
      i = file_.AfterBracket(i);
      continue;
    }
    if (!file_.IsWord(i) || file_.IsSign(i - 1, '.') || file_.IsSign(i - 1, '\\')) {
      ++i;
      continue;
    }
    const Designator designator = DesignatorAt(file_, i, range.end);
    if (file_.IsSign(i + 1, '(') && i + 1 < range.end) {
      const std::size_t after = std::min(file_.AfterBracket(i + 1), range.end);
      const auto routine = lowering_.declarations_.FindRoutine(designator.name, context_.scope);
      if (routine && !level.too_deep()) {
        Call(*routine, ArgumentsOf({&file_, i + 2, after - 1}), file_.PlaceOf(i));
        i = after;
        continue;
      }
      // The size of an array does not depend on its points.
      i = designator.name == "dim" ? after : i + 2;
      continue;
    }
    const auto bound = context_.instance->bound.find(designator.name);
    if (bound != context_.instance->bound.end()) {
      UseTargets(bound->second.targets, file_.PlaceOf(i), reason);
    }
    const auto part = values_.PartOf(designator, context_);
    if (part &&
        lowering_.declarations_.HoldsPoints(lowering_.declarations_.data[part->data].type)) {
      for (const std::size_t point : values_.PointsIn(*part)) {
        lowering_.Use(point, file_.PlaceOf(i), reason, steps_);
      }
    }
    for (const Accessor& accessor : designator.accessors) {
      if (accessor.field.empty() && !level.too_deep()) UseAll(accessor.index, reason);
    }
    i = designator.range.end;
  }
}

}  // namespace plumbline::programs::rapid
