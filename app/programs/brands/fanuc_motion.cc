#include "app/programs/brands/fanuc_motion.h"

#include <fmt/format.h>

#include "app/programs/brands/fanuc_statements.h"
#include "app/programs/brands/fanuc_words.h"

namespace plumbline::programs::fanuc {
namespace {

Target TargetAt(SourceCursor& at, const PointNumbers& points, bool& any) {
  at.SkipBlanks();
  const std::size_t begin = at.at();
  const bool taught = at.TakeWord() == "P";
  Target target;
  const Bracketed index = BracketedAt(at.Rest(), 0);
  at.Skip(index.after);
  const auto number = IndexIn(index.content);
  const auto point = taught && number ? points.find(*number) : points.end();
  if (point != points.end()) {
    target.point = point->second;
    return target;
  }
  target.computed = std::string(at.TextFrom(begin));
  if (taught && number) target.computed += " (not in /POS)";
  if (taught && !number) any = true;
  return target;
}

void Special(Motion& motion, std::string_view why) {
  if (motion.special.empty()) motion.special = why;
}

void Option(std::string_view word, SourceCursor& at, MotionStatement& read) {
  Motion& motion = read.motion;
  const auto is = [word](std::string_view known) { return SameWord(word, known); };
  const auto numbered = [word](std::string_view name) {
    return word.size() > name.size() && StartsWithWord(word, name) && IsDigit(word[name.size()]);
  };
  if (Lowered(word).ends_with("offset")) {
    Offset& offset = motion.end.offset;
    offset.in = StartsWithWord(word, "Tool") ? Offset::In::kTool : Offset::In::kBase;
    at.SkipBlanks();
    const std::size_t begin = at.at();
    if (at.Take(',')) {
      at.TakeWord();
      if (at.Peek() == '[') at.Skip(BracketedAt(at.Rest(), 0).after);
    }
    offset.unknown += fmt::format("{}{}{}: the register's value is not in the program",
                                  offset.unknown.empty() ? "" : "; ", word, at.TextFrom(begin));
  } else if (numbered("CNT")) {
    motion.passes_by = word.substr(3) != "0";
  } else if (is("CNT") || is("CD") || is("CR") || numbered("CD") || numbered("CR")) {
    motion.passes_by = true;
  } else if (is("INC")) {
    Special(motion, "relative motion (INC)");
  } else if (is("Skip") || is("SkipJump")) {
    Special(motion, "search: it ends where its condition comes true");
    const std::string_view next = at.Rest().substr(0, 64);
    for (const std::string_view label : {"LBL[", "LABEL["}) {
      const auto open = next.find(label);
      if (open != std::string_view::npos)
        read.skipped_to = BracketedAt(next, open + label.size() - 1).content;
    }
  } else if (is("Search")) {
    Special(motion, "touch search: it ends at the contact");
  } else if (is("COORD")) {
    Special(motion, "coordinated motion: its target is on a positioner");
  } else if (is("RTCP")) {
    Special(motion, "motion about a tool that stands in the cell (RTCP)");
  } else if (is("CALL")) {
    at.SkipBlanks();
    read.calls.emplace_back(CalledName(at.Rest()));
    at.Skip(read.calls.back().size());
  }
}

}  // namespace

std::optional<char> MotionLetter(std::string_view text) {
  if (text.size() < 4 || std::string_view("JLCAS").find(text[0]) == std::string_view::npos ||
      !IsBlank(text[1])) {
    return std::nullopt;
  }
  const std::string_view target = TrimBlanks(text.substr(1));
  return target.starts_with("P[") || target.starts_with("PR[") ? std::optional(text[0])
                                                               : std::nullopt;
}

std::string_view CalledName(std::string_view text) {
  text = TrimBlanks(text);
  return TrimBlanks(text.substr(0, text.find_first_of("(,; \t")));
}

MotionStatement ReadMotion(char letter, std::string_view text, const PointNumbers& points) {
  MotionStatement read;
  Motion& motion = read.motion;
  motion.kind = letter == 'J'   ? MotionKind::kJoint
                : letter == 'L' ? MotionKind::kLinear
                : letter == 'C' ? MotionKind::kCircular
                                : MotionKind::kSpline;
  SourceCursor at(text, 0);
  at.Skip();
  motion.end = TargetAt(at, points, read.may_be_any_point);
  bool listed = false;  // after a comma, PR[] belongs to an option
  while (!at.AtEnd()) {
    const std::size_t begin = at.at();
    const std::string_view written = at.TakeWord();
    if (written.empty()) {
      if (!IsBlank(at.Peek())) listed = at.Peek() == ',';
      if (at.Peek() == '[') {
        at.Skip(BracketedAt(at.Rest(), 0).after);
      } else {
        at.Skip();
      }
      continue;
    }
    const std::string_view word = EnglishWord(written);
    const bool target = (word == "P" || word == "PR") && at.Peek() == '[';
    if (target && letter == 'C' && !listed && !motion.via) {
      motion.via = std::move(motion.end);
      at.MoveTo(begin);
      motion.end = TargetAt(at, points, read.may_be_any_point);
      continue;
    }
    Option(word, at, read);
    listed = false;
  }
  if (letter == 'C' && !motion.via && motion.special.empty()) {
    motion.special = "circular motion without an end";
  }
  return read;
}

}  // namespace plumbline::programs::fanuc
