#include "app/programs/brands/krl_routine_reader.h"

#include <algorithm>

namespace plumbline::programs::krl {

namespace {

/// Functions of the KR C4 that limit the torques of the drives, so that the axes yield
/// [industrialmonitordirect.com, KUKA joint torque control]; the KR C2 has $TORQUE_AXIS for that.
constexpr std::string_view kSoftens = "SET_TORQUE_LIMITS", kStiffens = "RESET_TORQUE_LIMITS";

}  // namespace

void RoutineReader::FindShifts() {
  for (const Variable& variable : names_.variables()) {
    uses_soft_servo_ |= SameWord(variable.name, "$TORQUE_AXIS") && !variable.writes.empty();
    uses_stationary_ |= SameWord(variable.name, "$IPO_MODE") && !variable.writes.empty();
    for (const auto& [path, value] : variable.values) {
      uses_stationary_ |= path.ends_with(".ipo_frame") && SameWord(value.text, "#TCP");
    }
  }
  for (const Module& module : names_.modules()) {
    if (!module.src) continue;
    ForStatements(program_.files[*module.src], *module.src, lines_[*module.src],
                  [&](const Statement& statement) {
                    for (std::size_t at = 0; at < statement.size(); ++at) {
                      uses_soft_servo_ |= statement.HasWord(at, kSoftens);
                    }
                  });
  }
}

void RoutineReader::OpenRoutine(std::size_t routine) {
  routine_ = routine;
  blocks_.clear();
  broken_.clear();
  fdat_.reset();
  spline_.reset();
  in_spline_ = false;
  active_.clear();
}

void RoutineReader::CloseRoutine() {
  if (!routine_) return;
  Routine& routine = program_.routines[*routine_];
  const Place end{routine.place.file,
                  routine.steps.empty() ? routine.place.line : routine.steps.back().place.line};
  if (!blocks_.empty() && broken_.empty()) {
    broken_ = fmt::format("{} is not closed in {}", blocks_.back().kind, routine.name);
  }
  // Labels of open blocks are still jumped to.
  for (const Block& block : blocks_) {
    for (const std::string* const label : {&block.next, &block.end}) {
      if (!label->empty()) Label(*label, end);
    }
  }
  blocks_.clear();
  Emit(StepKind::kReturn, end);
  if (!broken_.empty()) {
    program_.remarks.push_back({end, broken_, true});
    std::vector<Step> uses;
    for (const Step& step : routine.steps) {
      if (step.kind != StepKind::kMotion) continue;
      for (const auto& target : {std::optional(step.motion.end), step.motion.via}) {
        if (!target || !target->point) continue;
        Step use;
        use.kind = StepKind::kUse;
        use.place = step.place;
        use.point = target->point;
        use.reason = "the order of the lines is not understood: " + broken_;
        uses.push_back(std::move(use));
      }
    }
    routine.steps.insert(routine.steps.begin(), uses.begin(), uses.end());
  }
  routine_.reset();
}

void RoutineReader::OpenBlock(std::string_view kind) {
  blocks_.push_back({kind, NewLabel(), NewLabel(), NewLabel()});
}

std::optional<Block> RoutineReader::CloseBlock(const Statement& statement, std::string_view kind) {
  fdat_.reset();
  if (blocks_.empty() || blocks_.back().kind != kind) {
    if (broken_.empty()) {
      broken_ = fmt::format("line {} closes a block that is not open", statement.line);
    }
    return std::nullopt;
  }
  Block block = std::move(blocks_.back());
  blocks_.pop_back();
  return block;
}

bool RoutineReader::ReadBlock(const Statement& statement) {
  const Place place = statement.place();
  const std::string word = Lowered(statement.tokens[0].text);
  const auto condition = [&] { Use(statement, 1, statement.size(), "it is used in a condition"); };
  const auto open_loop = [&](std::string_view kind, bool checks_first) {
    condition();
    OpenBlock(kind);
    Label(blocks_.back().top, place);
    if (checks_first) Jump(StepKind::kBranch, blocks_.back().end, place);
  };
  const auto close_loop = [&](std::string_view kind) {
    if (const auto block = CloseBlock(statement, kind)) {
      Jump(StepKind::kJump, block->top, place);
      Label(block->next, place);
      Label(block->end, place);
    }
  };
  if (word == "if") {
    condition();
    OpenBlock("if");
    Jump(StepKind::kBranch, blocks_.back().next, place);
  } else if (word == "else") {
    if (auto block = CloseBlock(statement, "if")) {
      Jump(StepKind::kJump, block->end, place);
      Label(block->next, place);
      block->next.clear();
      blocks_.push_back(std::move(*block));
    }
  } else if (word == "endif") {
    if (const auto block = CloseBlock(statement, "if")) {
      if (!block->next.empty()) Label(block->next, place);
      Label(block->end, place);
    }
  } else if (word == "for" || word == "while") {
    open_loop(word == "for" ? "for" : "while", true);
  } else if (word == "loop" || word == "repeat") {
    open_loop(word == "loop" ? "loop" : "repeat", false);
  } else if (word == "endfor") {
    close_loop("for");
  } else if (word == "endwhile") {
    close_loop("while");
  } else if (word == "endloop") {
    close_loop("loop");
  } else if (word == "until") {
    condition();
    if (const auto block = CloseBlock(statement, "repeat")) {
      Jump(StepKind::kBranch, block->top, place);
      Label(block->next, place);
      Label(block->end, place);
    }
  } else if (word == "exit") {
    const auto loop = std::find_if(blocks_.rbegin(), blocks_.rend(), [](const Block& block) {
      return block.kind != "if" && block.kind != "switch";
    });
    if (loop != blocks_.rend()) Jump(StepKind::kJump, loop->end, place);
  } else if (word == "switch") {
    condition();
    OpenBlock("switch");
    blocks_.back().top.clear();  // set behind the first CASE
    Jump(StepKind::kJump, blocks_.back().next, place);
  } else if (word == "case" || word == "default") {
    condition();
    if (auto block = CloseBlock(statement, "switch")) {
      if (!block->top.empty()) Jump(StepKind::kJump, block->end, place);
      block->top = "body";
      if (!block->next.empty()) Label(block->next, place);
      block->next.clear();
      if (word == "case") {
        block->next = NewLabel();
        Jump(StepKind::kBranch, block->next, place);
      }
      blocks_.push_back(std::move(*block));
    }
  } else if (word == "endswitch") {
    if (const auto block = CloseBlock(statement, "switch")) {
      if (!block->next.empty()) Label(block->next, place);
      Label(block->end, place);
    }
  } else if (word == "goto" && statement.HasAnyWord(1)) {
    Jump(StepKind::kJump, Lowered(statement.tokens[1].text), place);
  } else if (statement.size() == 2 && statement.Has(1, ':')) {
    Label(word, place);
  } else {
    return false;
  }
  fdat_.reset();
  return true;
}

void RoutineReader::ReadInterrupt(const Statement& statement) {
  const std::size_t at = statement.HasWord(0, "GLOBAL") ? 1 : 0;
  const auto number =
      at + 2 < statement.size() ? WholeNumberIn(statement.tokens[at + 2].text) : std::nullopt;
  if (statement.HasWord(at + 1, "ON") || statement.HasWord(at + 1, "ENABLE")) {
    for (const auto& [declared, handler] : handlers_) {
      if ((!number || declared == *number) && abandoning_.contains(handler))
        active_.insert(declared);
    }
    return;
  }
  if (statement.HasWord(at + 1, "OFF") || statement.HasWord(at + 1, "DISABLE")) {
    if (number) active_.erase(*number);
    if (!number) active_.clear();
    return;
  }
  // INTERRUPT DECL and TRIGGER: the routine behind DO runs at any time from here on.
  std::size_t action = statement.size();
  for (std::size_t i = at; i + 1 < statement.size(); ++i) {
    if (statement.HasWord(i, "DO")) action = i + 1;
  }
  Use(statement, at + 1, statement.size(), "it is used in a condition", false);
  if (!statement.HasAnyWord(action) || !statement.Has(action + 1, '(')) return;
  const std::string_view name = statement.tokens[action].text;
  if (IsSystemRoutine(name)) return;
  const auto routine = names_.FindRoutine(module_, name);
  Emit(StepKind::kEnableInterrupt, statement.place()).label =
      routine ? program_.routines[*routine].name : std::string(name);
}

void RoutineReader::Call(const Statement& statement, std::string_view name) {
  if (const auto routine = names_.FindRoutine(module_, name); routine && !IsSystemRoutine(name)) {
    Jump(StepKind::kCall, program_.routines[*routine].name, statement.place());
    if (!active_.empty()) interrupted_.insert(*routine);
    fdat_.reset();
    return;
  }
  if (SameWord(name, kSoftens) || SameWord(name, kStiffens)) {
    Shift(statement.place(),
          SameWord(name, kSoftens) ? fmt::format("soft servo ({}())", kSoftens) : "",
          uses_stationary_);
    return;
  }
  if (IsSystemRoutine(name)) return;
  Jump(StepKind::kCall, std::string(name), statement.place());
  fdat_.reset();
}

void RoutineReader::Use(const Statement& statement, std::size_t begin, std::size_t end,
                        std::string_view how, bool calls) {
  std::string_view argument_of;
  std::size_t arguments_end = 0;
  for (std::size_t at = begin; at < end; ++at) {
    if (statement.Has(at, '{')) {
      std::size_t behind = at;
      const auto aggregate = TakeAggregate(statement, names_.Bytes(statement.file), behind);
      const bool pose =
          aggregate && !aggregate->members.empty() &&
          (aggregate->members.front().name == "x" || aggregate->members.front().name == "a1");
      if (pose) {
        program_.remarks.push_back(
            {statement.place(), "a pose in an expression: it stays as it is"});
      }
      if (aggregate) at = behind - 1;
      continue;
    }
    if (!statement.HasAnyWord(at)) continue;
    const Token& token = statement.tokens[at];
    if (at > begin && statement.Has(at - 1, '#')) continue;
    if (at > begin && statement.Has(at - 1, '.') && at > begin + 1) continue;
    if (IsKeyword(token.text)) continue;
    if (statement.Has(at + 1, '(')) {
      if (at >= arguments_end || argument_of.empty()) {
        argument_of = token.text;
        arguments_end = statement.Behind(at + 1, end);
      }
      if (calls) Call(statement, token.text);
      continue;
    }
    std::size_t behind = at;
    const Reference reference = names_.TakeReference(statement, module_, routine_, behind);
    for (const Value* const value : names_.ValuesAt(reference)) {
      // One such use of a point is enough.
      if (!value->point || !used_.insert(*value->point).second) continue;
      std::string reason(how);
      if (!reference.component.empty()) {
        reason = fmt::format("its component {} is read", reference.component);
      } else if (at < arguments_end) {
        reason = fmt::format("it is passed to {}()", argument_of);
      }
      Step& use = Emit(StepKind::kUse, statement.place());
      use.point = value->point;
      use.reason = std::move(reason);
    }
  }
}

void RoutineReader::Apply(const Statement& statement, const Frames& frames) {
  const Place place = statement.place();
  if (frames.tool) Set(StepKind::kSetTool, place, *frames.tool);
  if (frames.base) Set(StepKind::kSetBase, place, *frames.base);
  if (frames.load) Set(StepKind::kSetLoad, place, *frames.load);
  if (frames.stationary) Shift(place, *frames.stationary, uses_soft_servo_);
}

/// One state holds the stationary tool and the soft servo: the end of one is taken for the end of
/// both only if the program does not use the other.
void RoutineReader::Shift(Place place, std::string why, bool uses_other) {
  if (why.empty() && uses_other) return;
  Set(StepKind::kShift, place, {"", std::move(why)});
}

void RoutineReader::ReadBas(const Statement& statement) {
  // BAS(#COMMAND, number)
  if (!statement.Has(2, '#') || !statement.HasAnyWord(3)) {
    const std::string why = "the command of BAS() is not constant";
    Apply(statement, {Setting{"", why}, Setting{"", why}, Setting{"", why}, why});
    return;
  }
  const std::string command = Lowered(statement.tokens[3].text);
  const std::size_t end = statement.Behind(1, statement.size());
  const auto number = [&]() -> std::optional<std::int64_t> {
    if (!statement.Has(4, ',') || end < 7) return std::nullopt;
    return names_.WholeNumber(statement, module_, routine_, 5, end - 1);
  };
  if (command == "tool") {
    Apply(statement, {settings_.Tool(number()), {}, settings_.Load(number()), {}});
  } else if (command == "base") {
    Apply(statement, {{}, settings_.Base(number()), {}, {}});
  } else if (command == "ex_base") {
    Apply(statement, {{}, Setting{"", "the base is moved by an external axis"}, {}, {}});
  } else if (command == "initmov") {
    Apply(statement, {settings_.Tool(1), settings_.Base(0), {}, ""});
  } else if (command == "frames" || command == "ptp_params" || command == "cp_params") {
    const std::string why = "the frame record in FDAT_ACT is not known here";
    Apply(statement,
          fdat_ ? *fdat_ : Frames{Setting{"", why}, Setting{"", why}, Setting{"", why}, why});
  }
}

void RoutineReader::ReadAssignment(const Statement& statement, std::size_t equals) {
  std::size_t at = 0;
  const std::size_t begin = equals + 1, end = statement.size();
  const Reference left = names_.TakeReference(statement, module_, routine_, at);
  const bool whole = left.path.empty() && left.component.empty();
  const Place place = statement.place();
  const std::string text(statement.Text(begin, end, names_.Bytes(statement.file)));
  const auto part_assigned = [&] {
    return Setting{"", fmt::format("a part of {} is assigned", left.name)};
  };
  if (SameWord(left.name, "$TOOL") || SameWord(left.name, "$BASE")) {
    const bool base = SameWord(left.name, "$BASE");
    Use(statement, begin, end, fmt::format("it is a frame: {} is set to it", left.name));
    const Setting setting =
        whole ? settings_.Frame(statement, module_, routine_, begin, end, base) : part_assigned();
    Set(base ? StepKind::kSetBase : StepKind::kSetTool, place, setting);
  } else if (SameWord(left.name, "$LOAD")) {
    Set(StepKind::kSetLoad, place,
        whole ? settings_.LoadIn(statement, module_, routine_, begin, end) : part_assigned());
  } else if (SameWord(left.name, "$IPO_MODE")) {
    const bool ordinary = SameWord(text, "#BASE");
    Shift(place,
          ordinary ? "" : "external TCP: the tool may be stationary ($IPO_MODE=" + text + ")",
          uses_soft_servo_);
  } else if (SameWord(left.name, "$TORQUE_AXIS")) {
    Shift(place, WholeNumberIn(text) == 0 ? "" : "soft servo ($TORQUE_AXIS=" + text + ")",
          uses_stationary_);
  } else if (SameWord(left.name, "FDAT_ACT")) {
    std::size_t behind = begin;
    if (whole && statement.HasAnyWord(begin)) {
      const Reference record = names_.TakeReference(statement, module_, routine_, behind);
      fdat_ = settings_.FramesOf(record);
    } else {
      fdat_.reset();
    }
  } else {
    if (!statement.Has(begin, '{')) {
      Use(statement, begin, end, fmt::format("it is copied to {}", left.name));
    }
    // The variables in the brackets of the left side.
    Use(statement, 1, equals, "it is used as an index");
  }
}

void RoutineReader::ReadStatement(const Statement& statement) {
  const Token& first = statement.tokens.front();
  if (first.kind != Token::Kind::kWord) {
    Use(statement, 0, statement.size(), "it is used in a line that is not understood");
    return;
  }
  const auto starts = [&](std::string_view word) { return first.IsWord(word); };
  if (starts("END") || starts("ENDFCT") || starts("DECL") || starts("EXT") || starts("EXTFCT") ||
      starts("SIGNAL") || starts("STRUC") || starts("ENUM") || starts("IMPORT")) {
    return;
  }
  const bool global = starts("GLOBAL");
  if (starts("INTERRUPT") || starts("TRIGGER") || (global && statement.HasWord(1, "INTERRUPT"))) {
    ReadInterrupt(statement);
    return;
  }
  if (const auto motion = MotionIn(statement)) {
    ReadMotion(statement, *motion);
    return;
  }
  if (starts("SPLINE") || starts("PTP_SPLINE")) {
    in_spline_ = true;
    spline_ = Motion{};
    if (statement.HasWord(1, "WITH")) ReadWith(statement, 2, *spline_);
    return;
  }
  if (starts("ENDSPLINE")) {
    in_spline_ = false;
    spline_.reset();
    return;
  }
  if (ReadBlock(statement)) return;
  if (starts("RETURN")) {
    Use(statement, 1, statement.size(), "it is returned");
    Emit(StepKind::kReturn, statement.place());
    return;
  }
  if (starts("RESUME")) {
    Emit(StepKind::kReturn, statement.place());
    return;
  }
  if (starts("HALT")) {
    Emit(StepKind::kPostureLost, statement.place());
    return;
  }
  if (starts("BAS") && statement.Has(1, '(')) {
    ReadBas(statement);
    return;
  }
  const std::size_t equals = statement.Find('=', 0, statement.size());
  if (equals < statement.size() && !statement.Has(equals + 1, '=') && !statement.Has(1, '(') &&
      !IsKeyword(first.text)) {
    ReadAssignment(statement, equals);
    return;
  }
  // Declarations without DECL; calls, waits and everything else.
  if (statement.size() >= 2 && statement.HasAnyWord(1) && !IsKeyword(first.text) &&
      !statement.Has(2, '(')) {
    return;
  }
  Use(statement, 0, statement.size(), "it is used in an expression");
}

}  // namespace plumbline::programs::krl
