#include "app/programs/brands/fanuc_statements.h"

#include <algorithm>
#include <charconv>

namespace plumbline::programs::fanuc {
namespace {

/// The text of a line after `nnn:`.
struct Instruction {
  bool numbered = false;
  std::size_t begin = 0;  ///< offset in the line
};

std::optional<Instruction> InstructionIn(std::string_view line) {
  std::size_t at = 0;
  const auto skip = [&](auto&& is) {
    const std::size_t first = at;
    while (at < line.size() && is(line[at])) ++at;
    return at > first;
  };
  skip(IsBlank);
  const bool numbered = skip(IsDigit);
  skip(IsBlank);
  if (at >= line.size() || line[at] != ':') return std::nullopt;
  return Instruction{numbered, at + 1};
}

}  // namespace

std::vector<Statement> StatementsOf(const SourceCursor& section, std::size_t file,
                                    const LineIndex& lines) {
  std::vector<Statement> statements;
  bool open = false;  // the last statement has no semicolon yet
  int block = 0, blocks = 0;
  const int first = lines.LineAt(section.at());
  const std::size_t end = section.at() + section.Rest().size();
  for (int line = first; line <= lines.count() && lines.Begin(line) < end; ++line) {
    const std::string_view text = lines.Text(line);
    const auto instruction = InstructionIn(text);
    if (!instruction) {
      open = false;
      if (TrimBlanks(text).starts_with("---")) block = 0;
      continue;
    }
    if (instruction->numbered || !open) {
      const std::size_t begin = lines.Begin(line) + instruction->begin;
      if (!statements.empty() && statements.back().text.find(",P-SPS") != std::string::npos)
        block = ++blocks;
      statements.push_back({{file, line}, {file, begin, begin}, "", block});
    }
    Statement& statement = statements.back();
    std::string_view content = TrimBlanks(text.substr(instruction->begin));
    open = !content.ends_with(';');
    if (!open) content.remove_suffix(1);
    if (!statement.text.empty()) statement.text += ' ';
    statement.text += TrimBlanks(content);
    statement.span.end = lines.End(line);
  }
  return statements;
}

Bracketed BracketedAt(std::string_view text, std::size_t open) {
  constexpr std::size_t kLongest = 256;  // bounds the time that unclosed brackets take
  const std::size_t end = std::min(text.size(), open + kLongest);
  int depth = 0;
  for (std::size_t at = open; at < end; ++at) {
    if (text[at] == '[') ++depth;
    if (text[at] == ']' && --depth == 0) return {text.substr(open + 1, at - open - 1), at + 1};
  }
  return {{}, std::min(open + 1, text.size())};
}

std::optional<long> IndexIn(std::string_view content) {
  content = TrimBlanks(content.substr(0, content.find(':')));
  long number = 0;
  const auto [end, error] =
      std::from_chars(content.data(), content.data() + content.size(), number);
  if (content.empty() || error != std::errc() || end != content.data() + content.size())
    return std::nullopt;
  return number;
}

std::vector<PointMention> PointsMentioned(std::string_view text) {
  std::vector<PointMention> mentions;
  for (std::size_t at = text.find("P["); at != std::string_view::npos;
       at = text.find("P[", at + 1)) {
    if (at > 0 && IsWordSign(text[at - 1])) continue;
    const std::string_view content = BracketedAt(text, at + 1).content;
    mentions.push_back({IndexIn(content.substr(0, content.find(',')))});
  }
  return mentions;
}

}  // namespace plumbline::programs::fanuc
