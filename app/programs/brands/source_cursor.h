// Lines, words and numbers in the bytes of a program, each with its place.
//
// Bytes are never decoded: those above 127 are neither letters nor blanks.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/programs/program.h"

namespace plumbline::programs {

/// Deepest nesting of brackets, braces and blocks that a grammar follows. What is nested deeper is
/// reported as not understood, so that no input overflows the stack.
inline constexpr int kMaxNesting = 64;

/// One level of nesting, for the scope of a recursive call.
class NestingLevel {
 public:
  explicit NestingLevel(int& depth) : depth_(depth) { ++depth_; }
  ~NestingLevel() { --depth_; }
  NestingLevel(const NestingLevel&) = delete;
  NestingLevel& operator=(const NestingLevel&) = delete;

  bool too_deep() const { return depth_ > kMaxNesting; }

 private:
  int& depth_;
};

/// Lines of a text. They count from 1; LF, CRLF and CR end a line.
class LineIndex {
 public:
  explicit LineIndex(std::string_view bytes);

  /// At least 1: an empty text has one empty line, and a text that ends with a line end has an
  /// empty last one.
  int count() const { return static_cast<int>(lines_.size()); }
  /// The line of a byte; its line end belongs to it. Logarithmic in the number of lines.
  int LineAt(std::size_t offset) const;
  std::size_t Begin(int line) const { return lines_[static_cast<std::size_t>(line) - 1].begin; }
  /// The end of a line without its line end.
  std::size_t End(int line) const { return lines_[static_cast<std::size_t>(line) - 1].end; }
  /// The bytes of a line without its line end.
  std::string_view Text(int line) const {
    return bytes_.substr(Begin(line), End(line) - Begin(line));
  }
  /// The line end of a line; empty for a last line without one.
  std::string_view LineEnd(int line) const;
  /// The line end of the first line that has one, otherwise LF: for lines that are inserted.
  std::string_view UsualLineEnd() const;

 private:
  struct Line {
    std::size_t begin = 0;
    std::size_t end = 0;
  };
  std::string_view bytes_;
  std::vector<Line> lines_;
};

bool IsBlank(char c);                                ///< space or tab
bool IsLineEnd(char c);                              ///< LF or CR
bool IsDigit(char c);                                ///< 0 to 9
bool IsLetter(char c);                               ///< A to Z, a to z
bool IsWordSign(char c);                             ///< letter, digit or underscore
std::string_view TrimBlanks(std::string_view text);  ///< without spaces and tabs around it
std::string Lowered(std::string_view text);          ///< A to Z only

/// Equality without regard to the case of A to Z.
bool SameWord(std::string_view a, std::string_view b);
bool StartsWithWord(std::string_view text, std::string_view start);  ///< likewise

/// Position in the bytes [begin, end) of a file, moved forward by what is recognised there. A
/// function that does not find what it looks for leaves the position unchanged.
class SourceCursor {
 public:
  SourceCursor(std::string_view bytes, std::size_t file)
      : SourceCursor(bytes, file, 0, bytes.size()) {}
  SourceCursor(std::string_view bytes, std::size_t file, std::size_t begin, std::size_t end);

  std::size_t at() const { return at_; }
  void MoveTo(std::size_t at);  ///< limited to the range
  bool AtEnd() const { return at_ >= end_; }
  /// The byte `ahead` of the position; '\0' beyond the end.
  char Peek(std::size_t ahead = 0) const;
  std::string_view Rest() const { return bytes_.substr(at_, end_ - at_); }
  Span SpanFrom(std::size_t begin) const { return {file_, begin, at_}; }
  std::string_view TextFrom(std::size_t begin) const { return bytes_.substr(begin, at_ - begin); }

  void SkipBlanks();
  void SkipSpace();  ///< blanks and line ends
  void Skip(std::size_t bytes = 1) { MoveTo(at_ + bytes); }

  bool Take(char c);
  /// A whole word in any case: "LIN" is not found in LIN_REL.
  bool TakeKeyword(std::string_view word);
  /// Letters, digits and underscores, with a first sign that is no digit, and the signs of `also`;
  /// empty if there is none.
  std::string_view TakeWord(std::string_view also = "");
  /// [+-] digits [. digits] [E [+-] digits], with at least one digit in front of the exponent.
  /// Nothing if a letter, digit or underscore follows, or if the value is no finite double.
  std::optional<Number> TakeNumber();

 private:
  std::string_view bytes_;
  std::size_t file_;
  std::size_t at_;
  std::size_t end_;
};

}  // namespace plumbline::programs
