#include "app/programs/brands/rapid_body.h"

#include <optional>
#include <set>

namespace plumbline::programs::rapid {

namespace {

/// Words that end a statement whose semicolon is missing.
bool EndsBlock(const TokenFile& file, std::size_t i) {
  for (const std::string_view word : {"ENDIF", "ENDFOR", "ENDWHILE", "ENDTEST", "ELSE", "ELSEIF"}) {
    if (file.IsWord(i, word)) return true;
  }
  return false;
}

bool IsOperator(const TokenFile& file, std::size_t i) {
  if (file.IsWord(i)) {
    for (const std::string_view word : {"AND", "OR", "XOR", "NOT", "DIV", "MOD"}) {
      if (file.IsWord(i, word)) return true;
    }
    return false;
  }
  if (file[i].kind != TokenKind::kSign) return false;
  const std::string_view text = file.Text(i);
  return text.size() == 2 ? text != ":="
                          : std::string_view("+-*/<>=").find(text[0]) != std::string_view::npos;
}

}  // namespace

std::vector<Step> StepsOf(Lowering& lowering, const Instance& instance) {
  return Body(lowering, instance).Run();
}

Step& Body::Add(StepKind kind, const Place& place, const std::string& label) {
  ++lowering_.steps_;
  Step step;
  step.kind = kind;
  step.place = place;
  step.label = label;
  steps_.push_back(std::move(step));
  return steps_.back();
}

std::vector<Step> Body::Run() {
  place_ = text_.place;
  const bool main = SameWord(text_.name, "main");
  if (main) {
    // What a start from main resets; where nothing sets it, nothing needs to be said.
    if (lowering_.Uses("gripload")) Add(StepKind::kSetExtra, place_);
    if (std::ranges::any_of(kShifts,
                            [&](const Shift& one) { return lowering_.Uses(one.begins); })) {
      Add(StepKind::kShift, place_);
    }
    Label("cycle");
  }
  if (text_.handles_backward) Branch("BACKWARD");
  if (text_.handles_undo) Branch("UNDO");
  MayFail();
  Label("body");
  for (std::size_t at = text_.body.begin; at < text_.body.end;) {
    if (lowering_.steps_ >= Lowering::kMostSteps) {
      lowering_.Remark(text_.place, "the program is too large to be followed to its end");
      for (std::size_t i = at; i < text_.body.end; ++i) {
        if (const auto point = lowering_.declarations_.PointAt(file_, i)) {
          lowering_.Use(*point, file_.PlaceOf(i), "the program is too large to be followed",
                        steps_);
        }
      }
      break;
    }
    place_ = file_.PlaceOf(at);
    at = std::max(Statement(at), at + 1);
  }
  while (!blocks_.empty()) {  // an END that is missing
    if (!blocks_.back().next.empty()) Label(blocks_.back().next);
    Label(blocks_.back().end);
    blocks_.pop_back();
  }
  if (main && !in_handler_) Branch("cycle");
  Add(StepKind::kReturn, place_);
  CloseLabels();
  return std::move(steps_);
}

void Body::CloseLabels() {
  std::set<std::string> wanted;
  for (const Step& step : steps_) {
    if (step.kind == StepKind::kJump || step.kind == StepKind::kBranch) wanted.insert(step.label);
  }
  for (const std::string& label : wanted) {
    if (labels_.count(label) > 0) continue;
    Label(label);
    Add(StepKind::kReturn, place_);
  }
}

std::size_t Body::EndOf(std::size_t at) const {
  while (at < text_.body.end && !file_.IsSign(at, ';') && !EndsBlock(file_, at)) {
    at = file_.AfterBracket(at);
  }
  return std::min(at, text_.body.end);
}

std::size_t Body::EndOfCondition(std::size_t at) const {
  const std::size_t end = text_.body.end;
  if (file_.IsSign(at, '<')) return std::min(at + 3, end);  // <EXP>, a condition not yet written
  while (at < end) {
    while (at < end && IsOperator(file_, at)) ++at;
    const bool word = file_.IsWord(at);
    at = file_.AfterBracket(at);
    while (word && at < end &&
           (file_.IsSign(at, '(') || file_.IsSign(at, '{') || file_.IsSign(at, '.') ||
            file_.IsSign(at - 1, '.'))) {
      at = file_.AfterBracket(at);
    }
    if (!IsOperator(file_, at) || file_.IsSign(at, ';')) break;
  }
  return std::min(at, end);
}

std::size_t Body::Section(std::size_t at) {
  const std::string name = file_.IsWord(at, "ERROR")      ? "ERROR"
                           : file_.IsWord(at, "BACKWARD") ? "BACKWARD"
                                                          : "UNDO";
  if (!in_handler_ && SameWord(text_.name, "main")) Branch("cycle");
  Add(StepKind::kReturn, place_);
  Label(name);
  in_handler_ = true;
  handler_acts_ = false;
  for (std::size_t i = at; i < text_.body.end; ++i) {
    if (!file_.IsWord(i)) continue;
    const std::string word = Lowered(file_.Text(i));
    handler_acts_ |= FindMotion(word) != nullptr || word == "gripload" ||
                     FindShift(word, &Shift::begins) != nullptr ||
                     FindShift(word, &Shift::ends) != nullptr ||
                     lowering_.declarations_.FindRoutine(word, text_.scope).has_value();
  }
  return file_.IsSign(at + 1, '(') ? file_.AfterBracket(at + 1) : at + 1;
}

std::size_t Body::Statement(std::size_t at) {
  const auto is = [&](std::string_view word) { return file_.IsWord(at, word); };
  const auto after = [&](std::size_t end) { return file_.IsSign(end, ';') ? end + 1 : end; };
  if (file_.IsSign(at, ';')) return at + 1;
  if (is("CONST") || is("PERS") || is("VAR")) return after(EndOf(at));
  if (is("ERROR") || is("BACKWARD") || is("UNDO")) return Section(at);
  if (is("IF")) return If(at);
  if (is("FOR") || is("WHILE")) {
    std::size_t end = at + 1;
    while (end < text_.body.end && !file_.IsWord(end, "DO") && !file_.IsSign(end, ';')) ++end;
    Block block{NewLabel(), "", NewLabel()};
    Label(block.top);
    UseAll({&file_, at + 1, end}, "its value decides where the program goes on");
    const bool endless = is("WHILE") && end == at + 2 && file_.IsWord(at + 1, "TRUE");
    if (!endless) Branch(block.end);
    blocks_.push_back(std::move(block));
    return end + 1;
  }
  if (is("TEST")) {
    std::size_t end = at + 1;
    while (end < text_.body.end && !file_.IsWord(end, "CASE") && !file_.IsWord(end, "DEFAULT") &&
           !file_.IsWord(end, "ENDTEST")) {
      ++end;
    }
    UseAll({&file_, at + 1, end}, "its value decides where the program goes on");
    blocks_.push_back({"", "", NewLabel()});
    return end;
  }
  if ((is("CASE") || is("DEFAULT")) && !blocks_.empty()) {
    const bool other = is("DEFAULT");
    std::size_t end = at + 1;
    while (end < text_.body.end && !file_.IsSign(end, ':') && !file_.IsSign(end, ';')) ++end;
    Block& block = blocks_.back();
    // The first alternative follows TEST at once: `next` is empty there.
    const bool first = block.next.empty();
    if (!first) {
      Jump(block.end);
      Label(block.next);
    }
    block.next = other ? "" : NewLabel();
    if (!other) Branch(block.next);
    return end + 1;
  }
  if ((is("ELSEIF") || is("ELSE")) && !blocks_.empty()) {
    Block& block = blocks_.back();
    Jump(block.end);
    if (!block.next.empty()) Label(block.next);
    block.next.clear();
    if (is("ELSE")) return at + 1;
    const std::size_t end = EndOfCondition(at + 1);
    UseAll({&file_, at + 1, end}, "its value decides where the program goes on");
    block.next = NewLabel();
    Branch(block.next);
    return file_.IsWord(end, "THEN") ? end + 1 : end;
  }
  if (is("ENDIF") || is("ENDTEST") || is("ENDFOR") || is("ENDWHILE")) {
    if (!blocks_.empty()) {
      const Block block = blocks_.back();
      blocks_.pop_back();
      if (!block.top.empty()) Jump(block.top);
      if (!block.next.empty()) Label(block.next);
      Label(block.end);
    }
    return at + 1;
  }
  if (file_.IsWord(at) && file_.IsSign(at + 1, ':')) {
    Label("label " + Lowered(file_.Text(at)));
    return at + 2;
  }
  if (file_.IsSign(at, '<')) {  // <SMT>, the place of a statement not yet written
    while (at < text_.body.end && !file_.IsSign(at, '>')) ++at;
    return at + 1;
  }
  const std::size_t end = EndOf(at);
  whole_statement_ = true;
  Simple({&file_, at, end});
  return after(end);
}

std::size_t Body::If(std::size_t at) {
  std::vector<std::string> skipped;
  while (file_.IsWord(at, "IF")) {
    const std::size_t end = EndOfCondition(at + 1);
    UseAll({&file_, at + 1, end}, "its value decides where the program goes on");
    const std::string next = NewLabel();
    Branch(next);
    if (file_.IsWord(end, "THEN")) {
      blocks_.push_back({"", next, NewLabel()});
      return end + 1;
    }
    skipped.push_back(next);
    at = end;
  }
  const std::size_t end = EndOf(at);
  whole_statement_ = false;
  Simple({&file_, at, end});
  for (const std::string& label : skipped) Label(label);
  return file_.IsSign(end, ';') ? end + 1 : end;
}

/// CONNECT interrupt WITH trap
void Body::Connect(Range statement) {
  std::size_t at = statement.begin;
  while (at < statement.end && !file_.IsWord(at, "WITH")) ++at;
  if (at + 1 >= statement.end) return;
  const std::string name(file_.Text(at + 1));
  const auto trap = lowering_.declarations_.FindRoutine(Lowered(name), context_.scope);
  if (!trap) {
    Add(StepKind::kEnableInterrupt, place_, name);
    return;
  }
  Instance instance;
  instance.routine = *trap;
  const std::string label = lowering_.Request(std::move(instance));
  if (!label.empty()) Add(StepKind::kEnableInterrupt, place_, label);
}

void Body::Simple(Range statement) {
  const std::size_t at = statement.begin;
  if (statement.empty()) return;
  if (file_.IsWord(at, "GOTO")) {
    Jump("label " + Lowered(file_.Text(at + 1)));
  } else if (file_.IsWord(at, "RETURN")) {
    const Range value{&file_, at + 1, statement.end};
    if (IsPointType(text_.type)) {  // the points that a function returns are used by its callers
      UseBesideTarget(value);
    } else {
      UseAll(value, "its value is returned by " + text_.name);
    }
    Add(StepKind::kReturn, place_);
  } else if (file_.IsWord(at, "RAISE")) {
    if (text_.handles_errors && !in_handler_) {
      Jump("ERROR");
    } else {
      Add(StepKind::kReturn, place_);
    }
  } else if (file_.IsWord(at, "RETRY") || file_.IsWord(at, "TRYNEXT") || file_.IsWord(at, "EXIT") ||
             file_.IsWord(at, "ExitCycle")) {
    // After RETRY the statement that failed is executed as if the error had not been; what holds
    // there is known already, unless the handler itself has done something.
    const bool resumes = file_.IsWord(at, "RETRY") || file_.IsWord(at, "TRYNEXT");
    if (resumes && in_handler_ && handler_acts_) {
      Jump("body");
    } else {
      Halt();
    }
  } else if (file_.IsWord(at, "CONNECT")) {
    Connect(statement);
  } else if (file_.IsSign(at, '%')) {
    CallLate(statement);
  } else if (file_.IsWord(at)) {
    Instruction(statement);
  } else {
    UseAll(statement, "in a statement that is not understood");
    lowering_.Remark(place_, "a statement that is not understood", true);
  }
}

}  // namespace plumbline::programs::rapid
