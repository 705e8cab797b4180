#include "app/programs/brands/urscript_routines.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

#include "app/programs/brands/urscript_functions.h"
#include "app/programs/brands/urscript_values.h"

namespace plumbline::programs::urscript {

namespace {

/// Steps for alternatives, in a file; beyond, a motion is reported as computed.
constexpr std::size_t kMostAlternativeSteps = 100'000;
constexpr int kMostParts = 50;  ///< of a name: tables[1][2].pick

class Lowering {
 public:
  Lowering(const Syntax& syntax, Values& values, std::size_t file, const Callable& callable,
           const Called& called_elsewhere, const std::string& prefix, Program& program)
      : syntax_(syntax),
        values_(values),
        file_(file),
        callable_(callable),
        called_elsewhere_(called_elsewhere),
        prefix_(prefix),
        program_(program) {}

  void Run();

 private:
  struct Block {
    StatementKind kind;
    std::string again;  ///< of a loop
    std::string next;   ///< of an `if`: its next branch; empty after `else`
    std::string after;
    std::size_t routine;  ///< kRoutine: the one that it is
  };

  void NameLiterals();
  void NameLiterals(std::size_t expr, const std::string& name, int depth);
  void FindCalled();
  void Read(const Statement& statement);
  void Close();
  void Visit(std::size_t expr);
  void Call(std::size_t call);
  bool Moves(const Expr& call);
  bool Sets(const Expr& call);
  void EndBlock() { values_.Forget(); }

  Step& Add(StepKind kind, int line) {
    Step step;
    step.kind = kind;
    step.place = {file_, line};
    std::vector<Step>& steps = routines_[now_].steps;
    steps.push_back(std::move(step));
    return steps.back();
  }
  void AddLabel(const std::string& label, int line) {
    Add(StepKind::kLabel, line).label = label;
    EndBlock();
  }
  std::string NewLabel() { return fmt::format("{}{}", prefix_, ++labels_); }
  std::string LabelOf(std::size_t routine) const;
  std::optional<std::size_t> PointOf(std::size_t literal);
  Target TargetOf(const std::optional<Destination>& destination, std::size_t expr);
  std::size_t Argument(const Expr& call, std::string_view name, std::size_t position) const;
  std::string Shortened(std::size_t expr) const;

  const Syntax& syntax_;
  Values& values_;
  std::size_t file_;
  const Callable& callable_;
  const Called& called_elsewhere_;
  const std::string& prefix_;
  Program& program_;
  std::vector<Routine> routines_;
  std::vector<Block> blocks_;
  std::vector<std::string> names_;             ///< of the literals
  std::vector<bool> called_;                   ///< by another routine
  std::map<std::size_t, std::size_t> points_;  ///< of the literals
  std::vector<Note> late_notes_;
  std::size_t now_ = 0;
  std::size_t labels_ = 0;
  std::size_t alternatives_ = 0;
};

std::size_t Lowering::Argument(const Expr& call, std::string_view name,
                               std::size_t position) const {
  for (std::size_t i = 0; i < call.parts.size(); ++i) {
    if (!name.empty() && call.part_names[i] == name) return call.parts[i];
  }
  if (position < call.parts.size() && call.part_names[position].empty()) {
    return call.parts[position];
  }
  return kNone;
}

std::string Lowering::Shortened(std::size_t expr) const {
  std::string text(values_.TextOf(expr).substr(0, 80));
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return text;
}

std::string Lowering::LabelOf(std::size_t routine) const {
  if (routine == 0) return prefix_ + "statements outside all routines";
  const std::string name(syntax_.routines[routine].name);
  const auto unique = callable_.find(name);
  if (values_.RoutineNamed(name) == routine && unique != callable_.end() &&
      unique->second == file_) {
    return name;
  }
  return fmt::format("{}{}{}", prefix_, name,
                     values_.RoutineNamed(name) == routine ? "" : fmt::format(" ({})", routine));
}

/// Names the poses and lists in an expression by the variable or call that they are a part of.
void Lowering::NameLiterals(std::size_t expr, const std::string& name, int depth) {
  const Expr& of = syntax_.exprs[expr];
  const bool call = of.kind == ExprKind::kCall, list = of.kind == ExprKind::kList;
  if (of.kind == ExprKind::kPose || list) names_[expr] = name;
  if (depth > kMostParts || of.kind == ExprKind::kPose) return;
  for (std::size_t i = 0; i < of.parts.size(); ++i) {
    if (syntax_.exprs[of.parts[i]].kind == ExprKind::kNumber) continue;
    const bool named = call && i < of.part_names.size() && !of.part_names[i].empty();
    NameLiterals(of.parts[i],
                 list    ? fmt::format("{}[{}]", name, i)
                 : named ? fmt::format("{}.{}", name, of.part_names[i])
                         : name,
                 depth + 1);
  }
}

void Lowering::NameLiterals() {
  names_.resize(syntax_.exprs.size());
  for (const Statement& statement : syntax_.statements) {
    if (statement.kind == StatementKind::kAssign && statement.expr != kNone) {
      NameLiterals(statement.expr, std::string(statement.name), 0);
    }
  }
}

void Lowering::FindCalled() {
  called_.assign(syntax_.routines.size(), false);
  for (const Expr& expr : syntax_.exprs) {
    if (expr.kind != ExprKind::kCall) continue;
    const std::size_t callee = values_.RoutineNamed(expr.name);
    if (callee != kNone && callee != expr.routine) called_[callee] = true;
  }
}

std::optional<std::size_t> Lowering::PointOf(std::size_t literal) {
  const auto [at, added] = points_.try_emplace(literal, program_.points.size());
  if (!added) return at->second;
  const Expr& written = syntax_.exprs[literal];
  Point point;
  point.name = names_[literal];
  point.place = {file_, written.line};
  point.kind = written.kind == ExprKind::kPose ? PointKind::kPose : PointKind::kJoints;
  bool zero = true;
  for (const std::size_t part : written.parts) {
    const Expr& number = syntax_.exprs[part];
    point.numbers.emplace_back(Number{{file_, number.begin, number.end}, number.number});
    zero &= number.number == 0;
  }
  if (zero && point.kind == PointKind::kPose) point.untouchable = "all numbers are 0: not taught";
  // PolyScope writes the joints of a waypoint NAME_p as NAME_q.
  if (point.kind == PointKind::kPose && point.name.ends_with("_p")) {
    const std::string joints = point.name.substr(0, point.name.size() - 1) + "q";
    if (const auto near_q = values_.ConstantVariable(joints); near_q && near_q->size() == 6) {
      point.near_q = *near_q;
    }
  }
  program_.points.push_back(std::move(point));
  return at->second;
}

Target Lowering::TargetOf(const std::optional<Destination>& destination, std::size_t expr) {
  Target target;
  if (!destination) {
    target.computed = Shortened(expr);
    return target;
  }
  target.point = PointOf(destination->literal);
  target.offset = destination->offset;
  if (!destination->near_q.empty()) {
    std::vector<double>& near_q = program_.points[*target.point].near_q;
    if (near_q.empty()) {
      near_q = destination->near_q;
    } else if (near_q != destination->near_q) {
      const Expr& at = syntax_.exprs[expr];
      late_notes_.push_back(
          {destination->literal, at.routine, at.line, "is reached near different joints (qnear)"});
    }
  }
  return target;
}

/// The key of a frame: its text, which can stand for another pose elsewhere.
std::string KeyOf(std::map<std::string, FrameValue>& frames, std::string text, const Pose& X,
                  const Place& place) {
  while (true) {
    const auto [at, added] = frames.try_emplace(text, FrameValue{place, X, {}, ""});
    if (added || (at->second.X.R == X.R && at->second.X.p == X.p)) return text;
    text += "'";
  }
}

bool Lowering::Moves(const Expr& call) {
  const MotionFunction* const motion = FindMotion(call.name);
  if (motion == nullptr) return false;
  const bool circle = motion->name == "movec";
  const std::size_t end_at = Argument(call, motion->targets[circle ? 1 : 0], circle ? 1 : 0);
  const std::size_t via_at = circle ? Argument(call, motion->targets[0], 0) : kNone;
  if (end_at == kNone) {
    program_.remarks.push_back({{file_, call.line}, "a motion without a target", true});
    return true;
  }
  using Destinations = std::vector<std::optional<Destination>>;
  Destinations ends = values_.Destinations(end_at);
  Destinations vias = via_at == kNone ? Destinations(1) : values_.Destinations(via_at);
  const std::size_t count = ends.size() * vias.size();
  alternatives_ += count > 1 ? count : 0;
  if (count > kMostAlternatives || alternatives_ > kMostAlternativeSteps) {
    for (const std::size_t at : {end_at, via_at}) {
      values_.NoteUse(at, "is one of too many targets of a motion");
    }
    ends = Destinations(1);
    vias = Destinations(1);
  }
  const std::size_t blend_at = motion->blend == 0 ? kNone : Argument(call, "r", motion->blend);
  const std::optional<double> blend = values_.ConstantNumber(blend_at);
  const std::string done = count > 1 ? NewLabel() : "";
  for (std::size_t i = 0; i < ends.size() * vias.size(); ++i) {
    const std::optional<Destination>& end = ends[i / vias.size()];
    const std::optional<Destination>& via = vias[i % vias.size()];
    const bool last = i + 1 == ends.size() * vias.size();
    const std::string next = last ? "" : NewLabel();
    if (!last) Add(StepKind::kBranch, call.line).label = next;
    Motion made;
    made.kind = motion->kind;
    made.end = TargetOf(end, end_at);
    if (via_at != kNone) made.via = TargetOf(via, via_at);
    const Place place{file_, call.line};
    made.base =
        Setting{end && !end->base.empty() ? KeyOf(program_.bases, end->base, end->X_base, place)
                                          : kRobotBase,
                ""};
    if (end && via && via->base != end->base) {
      made.special = "the auxiliary point and the end of the circle are in different features";
    }
    if (end && end->tool) {
      made.tool = Setting{KeyOf(program_.tools, "tool of get_inverse_kin", *end->tool, place), ""};
    }
    made.passes_by = blend_at != kNone && blend.value_or(1) != 0;
    if (!motion->special.empty()) made.special = motion->special;
    made.statement = {file_, call.begin, call.end};
    Add(StepKind::kMotion, call.line).motion = std::move(made);
    if (!last) {
      Add(StepKind::kJump, call.line).label = done;
      Add(StepKind::kLabel, call.line).label = next;
    } else if (count > 1 && i > 0) {
      Add(StepKind::kLabel, call.line).label = done;
    }
  }
  return true;
}

bool Lowering::Sets(const Expr& call) {
  if (call.name == "set_tcp") {
    const std::size_t pose = Argument(call, "pose", 0);
    values_.NoteConstant(pose, "is a tool (set_tcp)");
    Setting setting;
    if (const std::optional<Pose> X = pose == kNone ? std::nullopt : values_.ConstantPose(pose)) {
      setting.key = KeyOf(program_.tools, Shortened(pose), *X, {file_, call.line});
    } else {
      setting.unknown =
          fmt::format("set_tcp({}) is computed", pose == kNone ? "" : Shortened(pose));
    }
    Add(StepKind::kSetTool, call.line).setting = std::move(setting);
    return true;
  }
  const bool target = call.name == "set_target_payload", both = call.name == "set_payload";
  if (!target && !both && call.name != "set_payload_mass" && call.name != "set_payload_cog") {
    return false;
  }
  Setting setting;
  const std::size_t mass_at = Argument(call, "m", 0), cog_at = Argument(call, "cog", 1);
  const std::optional<double> mass = values_.ConstantNumber(mass_at);
  const auto cog = cog_at == kNone ? std::nullopt : values_.ConstantNumbers(cog_at);
  if (!target && !both) {
    setting.unknown = fmt::format("{}() states only a part of the load", call.name);
  } else if (!mass || (cog_at != kNone && (!cog || cog->size() != 3))) {
    setting.unknown = fmt::format("{}() has computed arguments", call.name);
  } else if (!cog && *mass != 0) {
    // Where the centre of gravity then is depends on the controller: as if not entered.
    setting.key = fmt::format("{}({})", call.name, *mass);
    program_.loads.try_emplace(setting.key, LoadValue{});
  } else {
    LoadValue load;
    load.mass_kg = *mass;
    if (cog) load.cog_F = {(*cog)[0], (*cog)[1], (*cog)[2]};
    setting.key = fmt::format("{} kg at [{}, {}, {}] m", *mass, load.cog_F.x(), load.cog_F.y(),
                              load.cog_F.z());
    program_.loads.try_emplace(setting.key, load);
  }
  Add(StepKind::kSetLoad, call.line).setting = std::move(setting);
  return true;
}

/// What a call does, after its arguments.
void Lowering::Call(std::size_t index) {
  const Expr& call = syntax_.exprs[index];
  if (Moves(call) || Sets(call)) return;
  const std::size_t routine = values_.RoutineNamed(call.name);
  const auto other_file = callable_.find(call.name);
  if (routine != kNone || other_file != callable_.end()) {
    if (routine == kNone) {
      for (const std::size_t part : call.parts) {
        values_.NoteUse(part, fmt::format("goes into {}() of another file", call.name));
      }
    }
    Add(StepKind::kCall, call.line).label = routine == kNone ? other_file->first : LabelOf(routine);
    EndBlock();
    return;
  }
  values_.Of(index);  // notes what goes into it
  const FunctionKind kind = KindOf(call.name);
  if (const ShiftFunctions* const shift = FindShift(call.name)) {
    Step& step = Add(StepKind::kShift, call.line);
    if (call.name == shift->begins) {
      step.setting.unknown = fmt::format("{} ({}, line {})", shift->what, call.name, call.line);
    }
  }
  // What force control or a conveyor has moved is not where it was.
  if (kind == FunctionKind::kMoves || kind == FunctionKind::kShift) {
    Add(StepKind::kPostureLost, call.line);
  } else if (kind == FunctionKind::kOther) {
    Add(StepKind::kCall, call.line).label = std::string(call.name);
  }
}

/// Calls inside an expression in the order in which they are executed.
void Lowering::Visit(std::size_t expr) {
  if (expr == kNone) return;
  const Expr& of = syntax_.exprs[expr];
  for (const std::size_t part : of.parts) {
    const ExprKind kind = syntax_.exprs[part].kind;
    if (kind != ExprKind::kNumber && kind != ExprKind::kName && kind != ExprKind::kWord) {
      Visit(part);
    }
  }
  if (of.kind == ExprKind::kCall) Call(expr);
}

void Lowering::Close() {
  const Block block = blocks_.back();
  blocks_.pop_back();
  const int line = routines_[now_].steps.empty() ? 0 : routines_[now_].steps.back().place.line;
  if (block.kind == StatementKind::kRoutine) {
    now_ = syntax_.routines[block.routine].outer;
    EndBlock();
    return;
  }
  if (block.kind != StatementKind::kIf) {
    Add(StepKind::kJump, line).label = block.again;
  } else if (!block.next.empty()) {
    AddLabel(block.next, line);
  }
  AddLabel(block.after, line);
}

void Lowering::Read(const Statement& statement) {
  const int line = statement.line;
  switch (statement.kind) {
    case StatementKind::kExpression:
    case StatementKind::kAssign:
    case StatementKind::kElementAssign:
      Visit(statement.expr);
      if (statement.expr != kNone) values_.Of(statement.expr);
      if (!statement.name.empty()) values_.Remember(statement);
      return;
    case StatementKind::kRun: {
      if (statement.expr == kNone) return;
      const Expr& call = syntax_.exprs[statement.expr];
      for (const std::size_t part : call.parts) Visit(part);
      const std::size_t thread = values_.RoutineNamed(call.name);
      Add(StepKind::kStartThread, line).label =
          thread == kNone ? std::string(call.name) : LabelOf(thread);
      return;
    }
    case StatementKind::kIf: {
      Visit(statement.expr);
      blocks_.push_back({StatementKind::kIf, "", NewLabel(), NewLabel(), 0});
      Add(StepKind::kBranch, line).label = blocks_.back().next;
      EndBlock();
      return;
    }
    case StatementKind::kElif:
    case StatementKind::kElse: {
      if (blocks_.empty() || blocks_.back().kind != StatementKind::kIf ||
          blocks_.back().next.empty()) {
        return;  // without an `if`
      }
      Add(StepKind::kJump, line).label = blocks_.back().after;
      AddLabel(std::exchange(blocks_.back().next, ""), line);
      if (statement.kind == StatementKind::kElif) {
        Visit(statement.expr);
        blocks_.back().next = NewLabel();
        Add(StepKind::kBranch, line).label = blocks_.back().next;
      }
      EndBlock();
      return;
    }
    case StatementKind::kWhile:
    case StatementKind::kOtherBlock: {
      Block block{statement.kind, NewLabel(), "", NewLabel(), 0};
      AddLabel(block.again, line);
      Visit(statement.expr);
      const bool forever = statement.kind == StatementKind::kWhile && statement.expr != kNone &&
                           values_.TextOf(statement.expr) == "True";
      if (!forever) Add(StepKind::kBranch, line).label = block.after;
      EndBlock();
      blocks_.push_back(std::move(block));
      return;
    }
    case StatementKind::kBreak:
    case StatementKind::kContinue:
      for (auto block = blocks_.rbegin(); block != blocks_.rend(); ++block) {
        if (block->kind == StatementKind::kRoutine) break;
        if (block->kind == StatementKind::kIf) continue;
        Add(StepKind::kJump, line).label =
            statement.kind == StatementKind::kBreak ? block->after : block->again;
        break;
      }
      return;
    case StatementKind::kReturn:
      Visit(statement.expr);
      values_.NoteUse(statement.expr, "is returned by a routine");
      Add(StepKind::kReturn, line);
      return;
    case StatementKind::kHalt: {
      const std::string stays = NewLabel();
      AddLabel(stays, line);
      Add(StepKind::kJump, line).label = stays;
      return;
    }
    case StatementKind::kRoutine:
      blocks_.push_back({StatementKind::kRoutine, "", "", "", statement.opens});
      now_ = statement.opens;
      EndBlock();
      return;
    case StatementKind::kEnd:
      if (!blocks_.empty()) Close();
      return;
  }
}

void Lowering::Run() {
  NameLiterals();
  FindCalled();
  for (std::size_t i = 0; i < syntax_.routines.size(); ++i) {
    const RoutineHead& head = syntax_.routines[i];
    Routine routine;
    routine.name = LabelOf(i);
    routine.place = {file_, head.line};
    // The operator starts the file; a file that only defines routines is started by those at the
    // outermost level that nothing calls.
    routine.starts = i == 0 || (head.outer == 0 && !called_[i] && head.parameters.empty() &&
                                !called_elsewhere_.contains(head.name));
    routines_.push_back(std::move(routine));
  }
  for (const Statement& statement : syntax_.statements) Read(statement);
  while (!blocks_.empty()) Close();

  // The poses that nothing mentions, then everything that is known about the other uses.
  for (std::size_t i = 0; i < syntax_.exprs.size(); ++i) {
    const Expr& expr = syntax_.exprs[i];
    if (expr.kind != ExprKind::kPose || expr.parts.size() != 6 || values_.is_constant(i)) continue;
    const bool written = std::all_of(expr.parts.begin(), expr.parts.end(), [&](std::size_t part) {
      return syntax_.exprs[part].kind == ExprKind::kNumber;
    });
    if (written) PointOf(i);
  }
  late_notes_.insert(late_notes_.end(), values_.notes().begin(), values_.notes().end());
  std::vector<std::vector<Step>> uses(routines_.size());
  for (const Note& note : late_notes_) {
    if (values_.is_constant(note.literal)) continue;
    Step use;
    use.kind = StepKind::kUse;
    use.place = {file_, note.line};
    use.point = PointOf(note.literal);
    use.reason = note.reason;
    uses[note.routine].push_back(std::move(use));
  }
  for (std::size_t i = 0; i < routines_.size(); ++i) {
    std::vector<Step>& steps = routines_[i].steps;
    steps.insert(steps.begin(), std::make_move_iterator(uses[i].begin()),
                 std::make_move_iterator(uses[i].end()));
    program_.routines.push_back(std::move(routines_[i]));
  }
}

}  // namespace

void AddRoutines(const Syntax& syntax, std::size_t file, const Callable& callable,
                 const Called& called_elsewhere, const std::string& file_prefix, Program& program) {
  Program discarded;
  Values first(syntax, program.files[file].bytes);
  Lowering(syntax, first, file, callable, called_elsewhere, file_prefix, discarded).Run();
  Values values(syntax, program.files[file].bytes);
  values.UseDirect(first.direct());
  Lowering(syntax, values, file, callable, called_elsewhere, file_prefix, program).Run();
}

}  // namespace plumbline::programs::urscript
