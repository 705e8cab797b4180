// Text for a terminal: its width, colours, and wrapped lines.
#pragma once

#include <string>
#include <string_view>

namespace plumbline::terminal {

/// Width of the terminal behind a descriptor, in columns; 0 if it is a file or a pipe. For a
/// terminal that reports no width (a serial console), $COLUMNS, or 80 if that is not set.
int TerminalColumns(int descriptor);

enum class Tone { kGood, kWarning, kFault };

/// The text in green, yellow or red if `colours`, else unchanged. Print it through Shown().
std::string Painted(std::string_view text, Tone tone, bool colours);

/// Start of a line that replaces the terminal's present one. Print it through Shown().
std::string ReplacedLine();

/// What may be written to a terminal: the colours of Painted() and ReplacedLine(), and the rest as
/// text::Visible(). Sequences of these two contain a random number, so that no file can imitate
/// them.
std::string Shown(std::string_view text);

/// Number of columns that UTF-8 text occupies; escape sequences of colours occupy none.
std::size_t ColumnsOf(std::string_view text);

/// Wraps a line without its line feed at spaces. Continuation lines are indented to the text after
/// the last gap of two or more spaces ("robot        UR10, ..."), otherwise by two columns more
/// than the first. A table row whose last column has no room for that, and a word that is too long,
/// are left unchanged.
std::string WrappedLine(std::string_view line, std::size_t columns);

/// Wraps running text: line feeds are treated as spaces. Lines after the first start with `indent`
/// spaces. The caller leaves room for these, and for what precedes the first line.
/// @param columns  of the text alone, without the indent
std::string WrappedParagraph(std::string_view text, std::size_t columns, std::size_t indent);

}  // namespace plumbline::terminal
