// The statements of a FANUC TP program: its section /MN.
#pragma once

#include <string>
#include <vector>

#include "app/programs/brands/source_cursor.h"
#include "app/programs/program.h"

namespace plumbline::programs::fanuc {

struct Statement {
  Place place;
  Span span;         ///< from its first line's text to the end of its last line
  std::string text;  ///< its lines joined, without numbers and the semicolon
  /// 0 for the program itself; its own number in each block of instructions that belongs to a
  /// motion (option P-SPS), which has labels of its own.
  int block = 0;
};

/// Statements start with `nnn:` and end with a semicolon; lines that start with a colon continue
/// one. Lines of another form are no instructions; one of dashes ends a block of a motion.
std::vector<Statement> StatementsOf(const SourceCursor& section, std::size_t file,
                                    const LineIndex& lines);

/// What is between the bracket at `open` and the one that closes it, with `after` behind that one;
/// nothing if it is not closed within 256 bytes.
struct Bracketed {
  std::string_view content;
  std::size_t after = 0;
};
Bracketed BracketedAt(std::string_view text, std::size_t open);

/// A decimal number, if the text up to a colon is one: "3", "3:left".
std::optional<long> IndexIn(std::string_view content);

/// A point in a statement that is no motion: `PR[5]=P[40]`, `P[3,2]=R[1]`.
struct PointMention {
  std::optional<long> number;  ///< absent: computed, P[R[1]]
};
std::vector<PointMention> PointsMentioned(std::string_view text);

}  // namespace plumbline::programs::fanuc
