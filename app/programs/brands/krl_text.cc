#include "app/programs/brands/krl_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

namespace plumbline::programs::krl {
namespace {

bool Opens(const Token& token) {
  return token.Is('{') || token.Is('[') || token.Is('(');
}
bool Closes(const Token& token) {
  return token.Is('}') || token.Is(']') || token.Is(')');
}

/// Behind the quote that closes the one at `at`, or `end`.
std::size_t BehindQuote(std::string_view bytes, std::size_t at, std::size_t end) {
  const std::size_t close = bytes.substr(0, end).find(bytes[at], at + 1);
  return close == std::string_view::npos ? end : close + 1;
}

}  // namespace

std::size_t Statement::Behind(std::size_t open, std::size_t end) const {
  int depth = 0;
  for (std::size_t at = open; at < end; ++at) {
    depth += Opens(tokens[at]) ? 1 : Closes(tokens[at]) ? -1 : 0;
    if (depth <= 0) return at + 1;
  }
  return end;
}

std::size_t Statement::Find(char sign, std::size_t begin, std::size_t end) const {
  for (std::size_t at = begin; at < end; at = Opens(tokens[at]) ? Behind(at, end) : at + 1) {
    if (tokens[at].Is(sign)) return at;
  }
  return end;
}

std::string_view Statement::Text(std::size_t begin, std::size_t end, std::string_view bytes) const {
  if (begin >= end || end > tokens.size()) return {};
  return bytes.substr(tokens[begin].begin, tokens[end - 1].end - tokens[begin].begin);
}

std::vector<Token> TokensOf(std::string_view bytes, std::size_t begin, std::size_t end) {
  std::vector<Token> tokens;
  SourceCursor cursor(bytes, 0, begin, end);
  for (;;) {
    cursor.SkipBlanks();
    const char c = cursor.Peek();
    if (cursor.AtEnd() || c == ';') return tokens;
    const std::size_t first = cursor.at();
    Token::Kind kind = Token::Kind::kSign;
    if (c == '"') {
      kind = Token::Kind::kText;
      cursor.MoveTo(BehindQuote(bytes, first, end));
    } else if (c == '\'') {
      kind = Token::Kind::kBits;
      cursor.MoveTo(BehindQuote(bytes, first, end));
    } else if (!cursor.TakeWord("$").empty()) {
      kind = Token::Kind::kWord;
    } else if (c != '+' && c != '-' && cursor.TakeNumber()) {
      kind = Token::Kind::kNumber;
    } else {
      cursor.Skip();
    }
    tokens.push_back({kind, first, cursor.at(), cursor.TextFrom(first)});
  }
}

std::optional<std::int64_t> WholeNumberIn(std::string_view text) {
  int base = 10;
  if (text.size() >= 4 && text.front() == '\'' && text.back() == '\'') {
    base = text[1] == 'B' || text[1] == 'b' ? 2 : text[1] == 'H' || text[1] == 'h' ? 16 : 10;
    if (base == 10 && text[1] != 'D' && text[1] != 'd') return std::nullopt;
    text = text.substr(2, text.size() - 3);
    if (text.front() == '-') return std::nullopt;
  } else if (text.starts_with('+')) {
    text.remove_prefix(1);
  }
  std::int64_t value = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value, base);
  if (error != std::errc() || stop != end) return std::nullopt;
  return value;
}

std::string WholeNumberLike(std::string_view old, std::int64_t value) {
  if (!old.starts_with('\'') || old.size() < 4) return fmt::format("{}", value);
  const std::size_t width = old.size() - 3;
  switch (old[1]) {
    case 'B':
    case 'b':
      return fmt::format("'{}{:0{}b}'", old[1], value, width);
    case 'H':
    case 'h':
      return fmt::format("'{}{:0{}X}'", old[1], value, width);
    default:
      return fmt::format("'{}{:0{}d}'", old[1], value, width);
  }
}

namespace {

std::optional<Aggregate> TakeNested(const Statement& statement, std::string_view bytes,
                                    std::size_t& at, int& depth) {
  const NestingLevel level(depth);
  if (level.too_deep() || !statement.Has(at, '{')) return std::nullopt;
  Aggregate aggregate;
  const std::size_t open = at++;
  if (statement.HasAnyWord(at) && statement.Has(at + 1, ':')) {
    aggregate.type = Lowered(statement.tokens[at].text);
    at += 2;
  }
  while (!statement.Has(at, '}')) {
    if (!aggregate.members.empty() && !statement.Has(at++, ',')) return std::nullopt;
    if (!statement.HasAnyWord(at)) return std::nullopt;
    Aggregate::Member member;
    member.name = Lowered(statement.tokens[at++].text);
    if (statement.Has(at, '[')) {
      const std::size_t behind = statement.Behind(at, statement.size());
      member.name += statement.Text(at, behind, bytes);
      at = behind;
    }
    const std::size_t value = at;
    if (statement.Has(at, '{')) {
      auto nested = TakeNested(statement, bytes, at, depth);
      if (!nested) return std::nullopt;
      member.nested.push_back(std::move(*nested));
    } else {
      // Words of an enumeration start with #.
      if (statement.Has(at, '-') || statement.Has(at, '+') || statement.Has(at, '#')) ++at;
      if (at >= statement.size() || statement.tokens[at].kind == Token::Kind::kSign) {
        return std::nullopt;
      }
      const std::size_t from = statement.tokens[value].begin, to = statement.tokens[at].end;
      SourceCursor cursor(bytes, statement.file, from, to);
      const auto number = cursor.TakeNumber();
      if (number && cursor.at() == to) member.number = number;
      ++at;
    }
    member.text = statement.Text(value, at, bytes);
    member.span = {statement.file, statement.tokens[value].begin, statement.tokens[at - 1].end};
    aggregate.members.push_back(std::move(member));
  }
  ++at;
  aggregate.span = {statement.file, statement.tokens[open].begin, statement.tokens[at - 1].end};
  return aggregate;
}

}  // namespace

std::optional<Aggregate> TakeAggregate(const Statement& statement, std::string_view bytes,
                                       std::size_t& at) {
  int depth = 0;
  std::size_t behind = at;
  auto aggregate = TakeNested(statement, bytes, behind, depth);
  if (aggregate) at = behind;
  return aggregate;
}

}  // namespace plumbline::programs::krl
