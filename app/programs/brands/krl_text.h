// Statements, tokens and aggregates of KRL, the language of KUKA controllers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/programs/brands/source_cursor.h"
#include "app/programs/program.h"

namespace plumbline::programs::krl {

struct Token {
  enum class Kind { kWord, kNumber, kText, kBits, kSign } kind = Kind::kSign;
  std::size_t begin = 0;
  std::size_t end = 0;
  std::string_view text;  ///< of a string or a bit string with its quotes

  bool Is(char sign) const { return kind == Kind::kSign && text.size() == 1 && text[0] == sign; }
  bool IsWord(std::string_view word) const { return kind == Kind::kWord && SameWord(text, word); }
};

/// A line of code without its comment. KRL has one statement to a line.
struct Statement {
  std::size_t file = 0;
  int line = 0;
  std::vector<Token> tokens;  ///< at least one

  Place place() const { return {file, line}; }
  std::size_t size() const { return tokens.size(); }
  bool Has(std::size_t index, char sign) const {
    return index < tokens.size() && tokens[index].Is(sign);
  }
  bool HasWord(std::size_t index, std::string_view word) const {
    return index < tokens.size() && tokens[index].IsWord(word);
  }
  bool HasAnyWord(std::size_t index) const {
    return index < tokens.size() && tokens[index].kind == Token::Kind::kWord;
  }
  /// The index behind the bracket that closes the one at `open`, at most `end`.
  std::size_t Behind(std::size_t open, std::size_t end) const;
  /// The first index in [begin, end) of a sign that is in no bracket; `end` if there is none.
  std::size_t Find(char sign, std::size_t begin, std::size_t end) const;
  /// The bytes of the tokens [begin, end).
  std::string_view Text(std::size_t begin, std::size_t end, std::string_view bytes) const;
};

/// Calls `visit` with each statement of a file, in order. Comments, empty lines and the header
/// lines (&ACCESS) are left out.
template <typename Visit>
void ForStatements(const SourceFile& file, std::size_t index, const LineIndex& lines,
                   const Visit& visit);

/// Tokens of a line up to its comment.
std::vector<Token> TokensOf(std::string_view bytes, std::size_t begin, std::size_t end);

/// The value of a whole number in decimals or as 'B1010' or 'HFF'; nullopt for another text.
std::optional<std::int64_t> WholeNumberIn(std::string_view text);
/// `value` in the notation of `old`, with at least as many digits.
std::string WholeNumberLike(std::string_view old, std::int64_t value);

/// {TYPE: NAME VALUE, ...}; strings, enumerations and bit strings are values as well.
struct Aggregate {
  struct Member;
  std::string type;  ///< in small letters; empty: not stated
  std::vector<Member> members;
  Span span;
};
struct Aggregate::Member {
  std::string name;               ///< in small letters, with its index: "cm", "point2[]"
  Span span;                      ///< of the value
  std::string_view text;          ///< of the value
  std::optional<Number> number;   ///< if it is one in decimals
  std::vector<Aggregate> nested;  ///< one, or none
};

/// The aggregate whose brace is the token at `at`, which is moved behind it; nullopt if it is not
/// understood (an expression in it, braces nested too deep).
std::optional<Aggregate> TakeAggregate(const Statement& statement, std::string_view bytes,
                                       std::size_t& at);

template <typename Visit>
void ForStatements(const SourceFile& file, std::size_t index, const LineIndex& lines,
                   const Visit& visit) {
  Statement statement;
  statement.file = index;
  for (int line = 1; line <= lines.count(); ++line) {
    const std::string_view text = TrimBlanks(lines.Text(line));
    if (text.empty() || text.front() == ';' || text.front() == '&') continue;
    statement.line = line;
    statement.tokens = TokensOf(file.bytes, lines.Begin(line), lines.End(line));
    if (!statement.tokens.empty()) visit(statement);
  }
}

}  // namespace plumbline::programs::krl
