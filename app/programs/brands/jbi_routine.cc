#include "app/programs/brands/jbi_routine.h"

#include <fmt/format.h>

#include <charconv>

namespace plumbline::programs::jbi {
namespace {

/// The words of a line up to its comment (`//`), split at blanks.
std::vector<std::string_view> WordsOf(std::string_view line) {
  line = line.substr(0, line.find("//"));
  std::vector<std::string_view> words;
  std::size_t at = 0;
  while (at < line.size()) {
    while (at < line.size() && IsBlank(line[at])) ++at;
    const std::size_t begin = at;
    while (at < line.size() && !IsBlank(line[at])) ++at;
    if (at > begin) words.push_back(line.substr(begin, at - begin));
  }
  return words;
}

bool HasWord(const std::vector<std::string_view>& words, std::string_view sought) {
  for (const std::string_view word : words) {
    if (word == sought) return true;
  }
  return false;
}

}  // namespace

std::optional<long> PointNumber(std::string_view word) {
  if (word.size() < 2 || word[0] != 'C') return std::nullopt;
  long number = 0;
  const char* const last = word.data() + word.size();
  const auto [end, error] = std::from_chars(word.data() + 1, last, number);
  if (error != std::errc() || end != last) return std::nullopt;
  return number;
}

Step& InstructionReader::Add(StepKind kind) {
  Step& step = routine_.steps.emplace_back();
  step.kind = kind;
  step.place = place_;
  return step;
}

std::string InstructionReader::NewLabel() {
  return fmt::format("#{}", ++last_label_);
}

/// A jump, call or return; with IF at the end of the line, or not at all.
void InstructionReader::Conditional(std::string_view line, StepKind kind, std::string label) {
  const bool conditional = HasWord(WordsOf(line), "IF");
  if (kind == StepKind::kJump) {
    Add(conditional ? StepKind::kBranch : kind).label = std::move(label);
    return;
  }
  const std::string skipped = NewLabel();
  if (conditional) Add(StepKind::kBranch).label = skipped;
  Add(kind).label = std::move(label);
  if (conditional) Add(StepKind::kLabel).label = skipped;
}

void InstructionReader::Read(std::string_view line, Place place, Span span) {
  place_ = place;
  line = TrimBlanks(line);
  const std::vector<std::string_view> words = WordsOf(line);
  if (words.empty() || line.starts_with('\'')) return;
  std::string_view word = words.front();
  if (word == "COMM") {
    program_.remarks.push_back({place, "disabled: " + std::string(line)});
    return;
  }
  if (word.starts_with('*')) {
    Add(StepKind::kLabel).label = std::string(word);
    return;
  }
  const std::string_view second = words.size() > 1 ? words[1] : std::string_view();
  const bool of_job = second.starts_with("JOB:");
  if (word.starts_with("MOV") || word.starts_with("SMOV") || word == "IMOV" || word == "SIMOV") {
    Move(word, line, span);
  } else if (word == "CALL") {
    Conditional(line, StepKind::kCall,
                std::string(of_job ? second.substr(4) : "a job that is chosen at run time"));
  } else if (word == "JUMP" && of_job) {
    Conditional(line, StepKind::kCall, std::string(second.substr(4)));
    Conditional(line, StepKind::kReturn, "");
  } else if (word == "JUMP") {
    Conditional(line, StepKind::kJump, std::string(second));
  } else if (word == "RET" || word == "END" || word == "ABORT") {
    Conditional(line, StepKind::kReturn, "");
  } else if (word == "PAUSE") {
    Add(StepKind::kPostureLost).reason = "PAUSE: the robot may be moved";
  } else if (word == "SFTON") {
    Add(StepKind::kShift).setting.unknown = std::string(line);
  } else if (word == "SFTOF") {
    Add(StepKind::kShift);
  } else if (!Structure(word)) {
    Uses(line);
  }
}

void InstructionReader::Move(std::string_view word, std::string_view line, Span span) {
  Motion motion;
  motion.statement = span;
  const std::vector<std::string_view> words = WordsOf(line);
  const bool master = word.starts_with('S') || HasWord(words, "UNTIL");
  const char letter = word.starts_with("SMOV") ? word.back() : word.size() > 3 ? word[3] : 'L';
  motion.kind = letter == 'J'                    ? MotionKind::kJoint
                : letter == 'C' || letter == 'S' ? MotionKind::kSpline
                                                 : MotionKind::kLinear;
  if (word.ends_with("IMOV")) motion.special = "relative motion (IMOV)";
  for (const std::string_view option : words) {
    if (option == "UNTIL") motion.special = "search: it ends where its condition comes true";
    if (option.starts_with('+') && master && motion.special.empty())
      motion.special = "coordinated motion: its target is on a station";
    if ((option.starts_with("PL=") && option != "PL=0") || option.starts_with("CR="))
      motion.passes_by = true;
  }
  if (word.starts_with("SMOV") && motion.special.empty())
    motion.special = "coordinated motion: its target is on a station";
  const std::string_view target = words.size() > 1 ? words[1] : std::string_view();
  const auto number = PointNumber(target);
  const auto found = number ? points_.find(*number) : points_.end();
  if (found != points_.end()) {
    motion.end.point = found->second.point;
    motion.tool = found->second.tool;
    motion.base = found->second.base;
  } else {
    motion.end.computed = std::string(target);
    if (number) motion.end.computed += " (not in //POS)";
  }
  Add(StepKind::kMotion).motion = std::move(motion);
}

/// IFTHEN, WHILE, FOR and SWITCH, with all that belongs to them.
bool InstructionReader::Structure(std::string_view word) {
  const bool begins = word.starts_with("IFTHEN") || word == "SWITCH";
  if (begins) {
    blocks_.push_back({NewLabel(), NewLabel(), "", word == "SWITCH"});
    Add(StepKind::kBranch).label = blocks_.back().otherwise;
    return true;
  }
  if (word.starts_with("WHILE") || word == "FOR") {
    blocks_.push_back({"", NewLabel(), NewLabel(), false});
    Add(StepKind::kLabel).label = blocks_.back().top;
    Add(StepKind::kBranch).label = blocks_.back().end;
    return true;
  }
  const bool next_part = word.starts_with("ELSE") || word == "CASE" || word == "DEFAULT";
  const bool ends = word == "ENDIF" || word == "ENDWHILE" || word == "NEXT" || word == "ENDSWITCH";
  if (!next_part && !ends) return false;
  if (blocks_.empty()) return true;
  Block& block = blocks_.back();
  if (next_part) {
    Add(StepKind::kJump).label = block.end;
    Add(StepKind::kLabel).label = block.otherwise;
    block.otherwise.clear();
    if (word != "ELSE" && word != "DEFAULT") {
      block.otherwise = NewLabel();
      Add(StepKind::kBranch).label = block.otherwise;
    }
    return true;
  }
  if (!block.top.empty()) Add(StepKind::kJump).label = block.top;
  if (!block.otherwise.empty()) Add(StepKind::kLabel).label = block.otherwise;
  Add(StepKind::kLabel).label = block.end;
  blocks_.pop_back();
  return true;
}

void InstructionReader::Uses(std::string_view line) {
  for (const std::string_view word : WordsOf(line)) {
    const auto number = PointNumber(word);
    const auto found = number ? points_.find(*number) : points_.end();
    if (found == points_.end()) continue;
    Step& use = Add(StepKind::kUse);
    use.point = found->second.point;
    use.reason = fmt::format("used in `{}`", line.substr(0, 60));
  }
}

void InstructionReader::Finish() {
  while (!blocks_.empty()) Structure("ENDIF");
}

}  // namespace plumbline::programs::jbi
