// Instructions of a routine of RAPID: motions, and what changes the state they depend on.
#include <optional>

#include "app/programs/brands/rapid_body.h"

namespace plumbline::programs::rapid {

void Body::Instruction(Range statement) {
  const Designator designator = DesignatorAt(file_, statement.begin, statement.end);
  const std::string& name = designator.name;
  if (file_.IsSign(designator.range.end, ":=")) {
    for (const Accessor& accessor : designator.accessors) {
      if (accessor.field.empty()) UseAll(accessor.index, "its value is used in a calculation");
    }
    const Range value{&file_, designator.range.end + 1, statement.end};
    const bool parameter = std::any_of(text_.parameters.begin(), text_.parameters.end(),
                                       [&](const Parameter& one) { return one.name == name; });
    const auto part = values_.PartOf(designator, context_);
    // A point that is copied as a whole has the uses of the variable, see Values.
    if (part && !parameter && values_.IsTarget(*part)) {
      UseBesideTarget(value);
    } else {
      UseAll(value, "its value is used in a calculation");
    }
    return;
  }
  const auto arguments = ArgumentsOf({&file_, statement.begin + 1, statement.end});
  const auto routine = lowering_.declarations_.FindRoutine(name, context_.scope);
  if (routine) {
    Call(*routine, arguments, place_);
    return;
  }
  if (const MotionInstruction* const motion = FindMotion(name)) {
    Move(*motion, statement, arguments);
    return;
  }
  if (StaysInPlace(name)) {
    SetState(name, statement, arguments);
    return;
  }
  if (name == "callbyvar") {
    lowering_.Remark(place_, "CallByVar calls a routine whose name is known only at run time");
  } else {
    lowering_.Remark(place_,
                     fmt::format("{} is not declared in these files", file_.Text(statement.begin)));
  }
  for (const Argument& argument : arguments) {
    UseAll(argument.value,
           fmt::format("passed to {}, which is not in these files", file_.Text(statement.begin)));
  }
  CallMissing(std::string(file_.Text(statement.begin)));
  MayFail();
}

/// A name that several modules declare means no routine of these files either.
void Body::CallMissing(std::string name) {
  if (lowering_.declarations_.DeclaresRoutine(Lowered(name))) name += " (declared several times)";
  Add(StepKind::kCall, place_, name);
}

bool Body::Given(const Argument& argument) const {
  if (!argument.conditional || argument.value.empty()) return true;
  const auto bound = context_.instance->bound.find(Lowered(file_.Text(argument.value.begin)));
  return bound != context_.instance->bound.end();
}

const Argument* Body::Optional(const std::vector<Argument>& arguments,
                               std::string_view name) const {
  for (const Argument& one : arguments) {
    if (one.name == name && Given(one)) return &one;
  }
  return nullptr;
}

bool Body::StopsAt(Range zone) const {
  if (zone.empty()) return false;
  if (file_.IsWord(zone.begin, "fine")) return true;
  const Designator designator = DesignatorAt(file_, zone.begin, zone.end);
  const auto bound = context_.instance->bound.find(designator.name);
  if (bound != context_.instance->bound.end() && bound->second.word == "fine") return true;
  const auto part = values_.PartOf(designator, context_);
  if (!part || values_.TypeOf(*part).first != "zonedata") return false;
  const auto data = values_.ValuesOf(*part);
  return data.size() == 1 && !data[0]->parts.empty() && !data[0]->parts[0].range.empty() &&
         data[0]->range.file->IsWord(data[0]->parts[0].range.begin, "TRUE");
}

Motion Body::MotionOf(const MotionInstruction& instruction, const std::vector<Argument>& arguments,
                      const std::vector<Range>& required, std::size_t after_targets) {
  Motion motion;
  motion.kind = instruction.kind;
  motion.special = std::string(instruction.special);
  // The tool is told from the other arguments by its type, or else by its position.
  Range tool, zone;
  for (std::size_t i = after_targets; i < required.size(); ++i) {
    if (values_.TypeOf(required[i], context_) == "tooldata") tool = required[i];
    if (StopsAt(required[i])) zone = required[i];
  }
  const std::size_t position =
      instruction.tool < 0 ? required.size() - 1 : static_cast<std::size_t>(instruction.tool);
  if (tool.empty() && position >= after_targets && position < required.size()) {
    tool = required[position];
  }
  motion.tool = values_.SettingOf(tool, "tooldata", context_);
  const Argument* const object = Optional(arguments, "wobj");
  motion.base = object != nullptr ? values_.SettingOf(object->value, "wobjdata", context_)
                                  : Setting{"wobj0", ""};
  const Argument* const load = Optional(arguments, "tload");
  if (load != nullptr && !SameWord(file_.Text(load->value.begin, load->value.end), "load0")) {
    motion.load = Setting{"", "\\TLoad replaces the load of the tool"};
  }
  const bool searches = !instruction.special.empty();
  motion.passes_by = !searches && zone.empty() && Optional(arguments, "inpos") == nullptr;
  if (values_.Stationary(*motion.tool) || values_.Stationary(*motion.base)) {
    motion.special = "the robot moves the work object along a stationary tool";
  } else if (Optional(arguments, "corr") != nullptr || Optional(arguments, "track") != nullptr) {
    motion.special = "a sensor guides the motion";
  }
  return motion;
}

void Body::Move(const MotionInstruction& instruction, Range statement,
                const std::vector<Argument>& arguments) {
  std::vector<Range> required;
  for (const Argument& argument : arguments) {
    if (argument.name.empty()) required.push_back(argument.value);
  }
  const std::size_t first = static_cast<std::size_t>(instruction.target);
  const bool circle = instruction.kind == MotionKind::kCircular;
  const std::size_t after_targets = first + (circle ? 2 : 1);
  if (required.size() < after_targets) {
    UseAll(statement, "in a motion that is not understood");
    lowering_.Remark(
        place_, fmt::format("{}: arguments that are not understood", file_.Text(statement.begin)),
        true);
    Add(StepKind::kPostureLost, place_);
    return;
  }
  Motion motion = MotionOf(instruction, arguments, required, after_targets);
  for (std::size_t i = 0; i < first; ++i) UseAll(required[i], "a search stores its result in it");
  for (std::size_t i = after_targets; i < required.size(); ++i) {
    UseAll(required[i], "its value is used in a calculation");
  }
  for (std::size_t i = first; i < after_targets; ++i) UseBesideTarget(required[i]);
  const auto ends = values_.TargetsOf(required[after_targets - 1], context_);
  const auto vias = circle ? values_.TargetsOf(required[first], context_) : std::vector<Target>{};
  const std::size_t count = std::max(ends.size(), vias.size());
  const auto here = lowering_.declarations_.PointAt(file_, required[after_targets - 1].begin);
  motion.statement = {
      file_.file(), file_[statement.begin].begin,
      file_.IsSign(statement.end, ';') ? file_[statement.end].end : file_[statement.end - 1].end};
  if (count > 1 || !whole_statement_ || (!here && !context_.instance->bound.empty())) {
    motion.statement.end = motion.statement.begin;
  }
  if (lowering_.steps_ + 4 * count >= Lowering::kMostSteps) {
    UseTargets(ends, place_, "one of too many points to be followed");
    UseTargets(vias, place_, "one of too many points to be followed");
    Add(StepKind::kPostureLost, place_);
    return;
  }
  // Several targets: one of them, and nobody knows which.
  const std::string end = count > 1 ? NewLabel() : "";
  for (std::size_t i = 0; i < count; ++i) {
    const std::string next = i + 1 < count ? NewLabel() : "";
    if (!next.empty()) Branch(next);
    motion.end = ends[i % ends.size()];
    if (circle) motion.via = vias[i % vias.size()];
    Add(StepKind::kMotion, place_).motion = motion;
    if (count > 1) Jump(end);
    if (!next.empty()) Label(next);
  }
  if (count > 1) Label(end);
  if (instruction.calls_procedure) CallNamed(required.back());
  MayFail();
}

/// The procedure that MoveLSync and its like execute at the end of the motion.
void Body::CallNamed(Range name) {
  std::string_view text = file_.Text(name.begin);
  const bool literal = name.end == name.begin + 1 && file_[name.begin].kind == TokenKind::kText;
  if (!literal || text.size() < 2) {
    CallMissing(std::string(file_.Text(name.begin, name.end)));
    return;
  }
  text = text.substr(1, text.size() - 2);
  text.remove_prefix(text.find(':') + 1);  // "MODULE:PROCEDURE"
  const auto routine = lowering_.declarations_.FindRoutine(Lowered(text), context_.scope);
  if (routine) {
    Call(*routine, {}, place_);
  } else {
    CallMissing(std::string(text));
  }
}

void Body::SetState(const std::string& name, Range statement,
                    const std::vector<Argument>& arguments) {
  if (name == "confj" || name == "confl") {
    Add(name == "confj" ? StepKind::kObeyJoint : StepKind::kObeyLinear, place_).setting.key =
        Optional(arguments, "off") == nullptr ? "" : "off";
  }
  if (name == "gripload" && !arguments.empty()) {
    Add(StepKind::kSetExtra, place_).setting =
        values_.SettingOf(arguments[0].value, "loaddata", context_);
    MayFail();
    return;
  }
  if (const Shift* const ends = FindShift(name, &Shift::ends)) {
    // One state holds all of them: the end of one is the end of all only if the program uses no
    // other.
    const bool other = std::ranges::any_of(kShifts, [&](const Shift& one) {
      return one.ends != ends->ends && lowering_.Uses(one.begins);
    });
    if (!other) Add(StepKind::kShift, place_);
    return;
  }
  if (const Shift* const begins = FindShift(name, &Shift::begins)) {
    const std::string_view text = file_.Text(statement.begin);
    Add(StepKind::kShift, place_).setting.unknown = fmt::format("{} {}", text, begins->what);
    for (const Argument& argument : arguments) {
      UseAll(argument.value, fmt::format("{} measures a displacement from it", text));
    }
    MayFail();
    return;
  }
  const std::string reason = fmt::format("passed to {}", file_.Text(statement.begin));
  for (const Argument& argument : arguments) {
    UseAll(argument.value, reason);
    if (ChangesArguments(name)) {
      const std::string type = values_.TypeOf(argument.value, context_);
      if (IsFrameType(type)) {
        values_.Changed(values_.SettingOf(argument.value, type, context_),
                        fmt::format("measured at run time by {}", file_.Text(statement.begin)));
      }
    }
  }
}

}  // namespace plumbline::programs::rapid
