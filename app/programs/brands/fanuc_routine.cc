#include "app/programs/brands/fanuc_routine.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "app/programs/brands/fanuc_motion.h"
#include "app/programs/brands/fanuc_words.h"

namespace plumbline::programs::fanuc {
namespace {

constexpr std::string_view kAnyLabel = "any label";

/// First words of instructions that consist of a bare name and are no macros.
bool IsInstruction(std::string_view word) {
  static constexpr std::array<std::string_view, 24> kWords = {
      "UNLOCK", "LOCK",      "ARC",  "WEAVE", "TRACK",  "SEARCH",  "COL",    "WAIT",
      "ENDIF",  "ENDFOR",    "RSR",  "CUT",   "STITCH", "MONITOR", "SENSOR", "TOUCH",
      "FB",     "TC_ONLINE", "ELSE", "IF",    "CALL",   "RUN",     "SPOT",   "MESSAGE"};
  return std::ranges::any_of(kWords, [&](std::string_view known) { return SameWord(known, word); });
}

/// Position of a character outside brackets and parentheses, or npos.
std::size_t FindOutside(std::string_view text, char sought, std::size_t from = 0) {
  int depth = 0;
  for (std::size_t at = from; at < text.size(); ++at) {
    const char c = text[at];
    if (c == sought && depth == 0) return at;
    if (c == '(' || c == '[') ++depth;
    if ((c == ')' || c == ']') && depth > 0) --depth;
  }
  return std::string_view::npos;
}

/// What displaces all targets from an instruction on, in capitals; "" if the instruction does not.
/// With SOFTFLOAT the joints yield more than the stiffness of the arm says.
std::string ShiftIn(std::string_view text) {
  SourceCursor at(TrimBlanks(text), 0);
  const std::string_view word = EnglishWord(at.TakeWord());
  const bool shifts = SameWord(word, "TRACK") || SameWord(word, "SOFTFLOAT") ||
                      (SameWord(word, "Touch") && StartsWithWord(TrimBlanks(at.Rest()), "Offset"));
  return shifts ? Capitals(word) : std::string();
}

class Lowering {
 public:
  Lowering(const Surroundings& around, Program& program, Routine& routine)
      : around_(around), program_(program), routine_(routine) {}

  void Read(const Statement& statement) {
    statement_ = &statement;
    const std::string_view text = statement.text;
    const bool of_select =
        text.starts_with('=') || StartsWithWord(text, "ELSE,") || StartsWithWord(text, "ELSE ,");
    if (select_end_ && !of_select) Add(StepKind::kLabel).label = *std::exchange(select_end_, {});
    if (select_end_) {
      Case(text);
    } else {
      Instruction(text, 0);
    }
  }

  void Finish() {
    if (select_end_) Add(StepKind::kLabel).label = *select_end_;
    if (!jumps_anywhere_) return;
    Add(StepKind::kReturn);
    Add(StepKind::kLabel).label = kAnyLabel;
    for (const std::string& label : labels_) Add(StepKind::kBranch).label = label;
    Add(StepKind::kReturn);
  }

 private:
  Step& Add(StepKind kind) {
    Step& step = routine_.steps.emplace_back();
    step.kind = kind;
    if (statement_ != nullptr) step.place = statement_->place;
    return step;
  }

  std::string NewLabel() { return fmt::format("#{}", ++last_label_); }

  void Jump(StepKind kind, std::string label) {
    jumps_anywhere_ |= label == kAnyLabel;
    Add(kind).label = std::move(label);
  }

  std::string LabelOf(std::string_view content) const {
    const auto number = IndexIn(content);
    if (!number) return std::string(kAnyLabel);
    return statement_->block == 0 ? fmt::format("LBL[{}]", *number)
                                  : fmt::format("LBL[{}] in block {}", *number, statement_->block);
  }

  /// `LBL[n]` at the first word LBL of a text, or nothing.
  std::optional<std::string> LabelIn(std::string_view text) const {
    for (const std::string_view word : {"LBL[", "LABEL["}) {
      const auto at = text.find(word);
      if (at != std::string_view::npos)
        return LabelOf(BracketedAt(text, at + word.size() - 1).content);
    }
    return std::nullopt;
  }

  void Instruction(std::string_view text, int depth) {
    text = TrimBlanks(text);
    if (text.empty() || text.starts_with('!') || text.starts_with("--")) return;
    if (text.starts_with("//")) {
      if (MotionLetter(TrimBlanks(text.substr(2)))) {
        program_.remarks.push_back({statement_->place, "disabled motion: " + std::string(text)});
      }
      return;
    }
    if (const auto letter = MotionLetter(text)) return Motions(*letter, text);
    if (depth > kMaxNesting) {
      program_.remarks.push_back({statement_->place, "nested too deeply", true});
      return Call(text.substr(0, 40));
    }
    SourceCursor at(text, 0);
    const std::string_view word = EnglishWord(at.TakeWord());
    const std::string_view rest = TrimBlanks(at.Rest());
    const auto is = [word](std::string_view known) { return SameWord(word, known); };
    if (is("UTOOL_NUM")) return Select(StepKind::kSetTool, word, rest);
    if (is("UFRAME_NUM")) return Select(StepKind::kSetBase, word, rest);
    if (is("PAYLOAD") && rest.starts_with('[')) return Payload(BracketedAt(rest, 0).content);
    if (is("LBL") && rest.starts_with('[')) return Label(BracketedAt(rest, 0).content);
    if (is("JMP")) return Jump(StepKind::kJump, LabelIn(rest).value_or(std::string(kAnyLabel)));
    if (is("CALL")) return Call(CalledName(rest));
    if (is("RUN")) return;  // another task, with other axes
    if (is("IF")) return If(rest, depth);
    if (is("ELSE")) return Else();
    if (is("ENDIF")) return Close(false);
    if (is("FOR")) return For();
    if (is("ENDFOR")) return Close(true);
    if (is("SELECT")) return Selection(rest);
    if (is("END") || is("ABORT")) return static_cast<void>(Add(StepKind::kReturn));
    if (is("PAUSE") || is("UALM"))
      return LosePosture(std::string(word) + ": the robot may be moved");
    if (is("WAIT")) {
      if (const auto label = LabelIn(rest)) Jump(StepKind::kBranch, *label);
      return;
    }
    if (!ShiftIn(text).empty()) return Shift(text, Lowered(rest).ends_with("end"));
    Other(text, word);
  }

  /// One state holds seam tracking, touch offsets and the soft servo: the end of one is taken for
  /// the end of all only if the program uses no other.
  void Shift(std::string_view text, bool ends) {
    if (ends && around_.shifts->size() > 1) return;
    Step& step = Add(StepKind::kShift);
    if (!ends) step.setting.unknown = std::string(text);
  }

  /// `UTOOL_NUM=2`, `UTOOL_NUM[GP1]=R[5]`.
  void Select(StepKind kind, std::string_view word, std::string_view rest) {
    if (rest.starts_with('[')) {
      const Bracketed group = BracketedAt(rest, 0);
      if (group.content != "GP1") return;
      rest = TrimBlanks(rest.substr(group.after));
    }
    if (!rest.starts_with('=')) return;
    rest = TrimBlanks(rest.substr(1));
    const auto number = IndexIn(rest);
    Setting& setting = Add(kind).setting;
    if (!number) {
      setting.unknown = fmt::format("{}={} is computed", word, rest);
      return;
    }
    setting = Value(kind == StepKind::kSetTool ? "UTOOL" : "UFRAME", *number);
  }

  /// The value with this number, unless a program assigns it.
  Setting Value(std::string_view what, long number) const {
    const std::string key = fmt::format("{} {}", what, number);
    for (const std::string& assigned : {key, fmt::format("{} *", what)}) {
      const auto found = around_.assigned->find(assigned);
      if (found != around_.assigned->end())
        return {"", fmt::format("{}[{}] is assigned at {}", what, number, found->second)};
    }
    return {key, ""};
  }

  /// `PAYLOAD[1]`, `PAYLOAD[GP1:R[13]]`, `PAYLOAD[2:gripper]`.
  void Payload(std::string_view content) {
    if (content.starts_with("GP")) {
      const auto colon = content.find(':');
      if (content.substr(0, colon) != "GP1" || colon == std::string_view::npos) return;
      content.remove_prefix(colon + 1);
    }
    const auto number = IndexIn(content);
    Setting& setting = Add(StepKind::kSetLoad).setting;
    if (number) {
      setting = Value("PAYLOAD", *number);
    } else {
      setting.unknown = fmt::format("PAYLOAD[{}] is computed", content);
    }
  }

  void Label(std::string_view content) {
    std::string label = LabelOf(content);
    if (label != kAnyLabel && statement_->block == 0) labels_.push_back(label);
    Add(StepKind::kLabel).label = std::move(label);
  }

  void Call(std::string_view name) { Add(StepKind::kCall).label = Capitals(name); }

  void LosePosture(std::string why) { Add(StepKind::kPostureLost).reason = std::move(why); }

  /// The rest of an IF: `condition,action`, `condition,action,ELSE,action`, `(condition) THEN`.
  void If(std::string_view rest, int depth) {
    Uses(rest.substr(0, FindOutside(rest, ',')));
    const std::size_t comma = FindOutside(rest, ',');
    if (comma == std::string_view::npos) {
      blocks_.push_back({NewLabel(), NewLabel(), "", false});
      Add(StepKind::kBranch).label = blocks_.back().otherwise;
      return;
    }
    std::string_view action = TrimBlanks(rest.substr(comma + 1)), otherwise;
    const std::size_t second = FindOutside(action, ',');
    if (second != std::string_view::npos) {
      const std::string_view after = TrimBlanks(action.substr(second + 1));
      if (StartsWithWord(after, "ELSE")) {
        otherwise = after.substr(4);
        while (otherwise.starts_with(',') || otherwise.starts_with(' ')) otherwise.remove_prefix(1);
        action = action.substr(0, second);
      }
    }
    const std::string skipped = NewLabel();
    Add(StepKind::kBranch).label = skipped;
    Instruction(action, depth + 1);
    if (otherwise.empty()) {
      Add(StepKind::kLabel).label = skipped;
      return;
    }
    const std::string end = NewLabel();
    Add(StepKind::kJump).label = end;
    Add(StepKind::kLabel).label = skipped;
    Instruction(otherwise, depth + 1);
    Add(StepKind::kLabel).label = end;
  }

  void Else() {
    if (blocks_.empty() || blocks_.back().loop || blocks_.back().otherwise.empty()) return;
    Add(StepKind::kJump).label = blocks_.back().end;
    Add(StepKind::kLabel).label = std::exchange(blocks_.back().otherwise, {});
  }

  void For() {
    blocks_.push_back({"", NewLabel(), NewLabel(), true});
    Add(StepKind::kLabel).label = blocks_.back().top;
    Add(StepKind::kBranch).label = blocks_.back().end;
  }

  void Close(bool loop) {
    if (blocks_.empty() || blocks_.back().loop != loop) return;
    const Block block = blocks_.back();
    blocks_.pop_back();
    if (loop) Add(StepKind::kJump).label = block.top;
    if (!block.otherwise.empty()) Add(StepKind::kLabel).label = block.otherwise;
    Add(StepKind::kLabel).label = block.end;
  }

  /// `SELECT R[1]=1,JMP LBL[1]` and its further lines `=2,CALL X` and `ELSE,CALL Y`.
  void Selection(std::string_view rest) {
    select_end_ = NewLabel();
    const auto equals = FindOutside(rest, '=');
    if (equals != std::string_view::npos) Case(rest.substr(equals));
  }

  void Case(std::string_view text) {
    const bool otherwise = StartsWithWord(text, "ELSE");
    const auto comma = FindOutside(text, ',');
    if (comma == std::string_view::npos) return;
    const std::string next = NewLabel();
    if (!otherwise) Add(StepKind::kBranch).label = next;
    Instruction(text.substr(comma + 1), 1);
    Add(StepKind::kJump).label = *select_end_;
    Add(StepKind::kLabel).label = next;
  }

  /// An assignment, an instruction of an application, or a macro: a name without brackets.
  void Other(std::string_view text, std::string_view word) {
    Uses(text);
    if (text.starts_with('$')) {
      const bool assigns = FindOutside(text, '=') != std::string_view::npos;
      if (assigns && text.find("MNUTOOLNUM") != std::string_view::npos)
        Add(StepKind::kSetTool).setting.unknown = std::string(text);
      if (assigns && text.find("MNUFRAMENUM") != std::string_view::npos)
        Add(StepKind::kSetBase).setting.unknown = std::string(text);
      return;
    }
    const bool named = !word.empty() && text.find_first_of("[=") == std::string_view::npos;
    if (!named || IsInstruction(word) || FindOutside(text, '=') != std::string_view::npos) return;
    Call(TrimBlanks(text.substr(0, text.find('('))));
  }

  void Uses(std::string_view text) {
    for (const PointMention& mention : PointsMentioned(text)) {
      if (!mention.number) {
        AnyPoint(text);
        continue;
      }
      const auto point = around_.points->find(*mention.number);
      if (point == around_.points->end()) continue;
      Step& use = Add(StepKind::kUse);
      use.point = point->second;
      use.reason = fmt::format("used in `{}`", text.substr(0, 60));
    }
  }

  /// A point with a computed number may be any point of the program.
  void AnyPoint(std::string_view text) {
    if (any_point_) return;
    any_point_ = true;
    for (const auto& [number, point] : *around_.points) {
      std::string& why = program_.points[point].untouchable;
      if (why.empty())
        why = fmt::format("`{}` in line {} may be any point of the program", text.substr(0, 60),
                          statement_->place.line);
    }
  }

  void Motions(char letter, std::string_view text) {
    MotionStatement read = ReadMotion(letter, text, *around_.points);
    read.motion.statement = statement_->span;
    if (read.may_be_any_point) AnyPoint(text);
    Add(StepKind::kMotion).motion = std::move(read.motion);
    if (read.skipped_to) Jump(StepKind::kBranch, LabelOf(*read.skipped_to));
    for (const std::string& name : read.calls) Call(name);
  }

  struct Block {
    std::string otherwise, end, top;
    bool loop = false;
  };

  const Surroundings& around_;
  Program& program_;
  Routine& routine_;
  const Statement* statement_ = nullptr;
  int last_label_ = 0;
  bool jumps_anywhere_ = false, any_point_ = false;
  std::vector<std::string> labels_;
  std::vector<Block> blocks_;
  std::optional<std::string> select_end_;
};

}  // namespace

std::string Capitals(std::string_view text) {
  std::string capitals(text);
  for (char& c : capitals) {
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  }
  return capitals;
}

void FindAssigned(const std::vector<Statement>& statements, const std::string& file,
                  Assigned& assigned) {
  struct Written {
    std::string_view name, key;
    bool grouped;  ///< the index is [group, number]
  };
  static constexpr std::array kWritten = {
      Written{"UFRAME[", "UFRAME", false},      Written{"UTOOL[", "UTOOL", false},
      Written{"$MNUFRAME[", "UFRAME", true},    Written{"$MNUTOOL[", "UTOOL", true},
      Written{"$PLST_GRP1[", "PAYLOAD", false},
  };
  for (const Statement& statement : statements) {
    for (const Written& written : kWritten) {
      const std::string_view text = statement.text;
      const auto at = text.find(written.name);
      if (at == std::string_view::npos || text.starts_with('!') || text.starts_with("//")) continue;
      if (at > 0 && (IsWordSign(text[at - 1]) || text[at - 1] == '$')) continue;
      const Bracketed index = BracketedAt(text, at + written.name.size() - 1);
      if (FindOutside(text, '=', index.after) == std::string_view::npos) continue;
      std::string_view content = index.content;
      if (content.starts_with("GP"))
        content.remove_prefix(std::min(content.find(':'), content.size() - 1) + 1);
      if (written.grouped)
        content.remove_prefix(std::min(content.find(','), content.size() - 1) + 1);
      const auto number = IndexIn(content);
      assigned.try_emplace(
          fmt::format("{} {}", written.key, number ? std::to_string(*number) : std::string("*")),
          fmt::format("{}:{}", file, statement.place.line));
    }
  }
}

void FindShifts(const std::vector<Statement>& statements, std::set<std::string>& shifts) {
  for (const Statement& statement : statements) {
    std::string shift = ShiftIn(statement.text);
    if (!shift.empty()) shifts.insert(std::move(shift));
  }
}

void ReadRoutine(const std::vector<Statement>& statements, const Surroundings& around,
                 Program& program, Routine& routine) {
  Lowering lowering(around, program, routine);
  for (const Statement& statement : statements) lowering.Read(statement);
  lowering.Finish();
}

std::set<std::string> CalledBy(const Routine& routine) {
  std::set<std::string> called;
  for (const Step& step : routine.steps) {
    if (step.kind == StepKind::kCall) called.insert(step.label);
  }
  return called;
}

}  // namespace plumbline::programs::fanuc
