// Everything that the commands print: made harmless, and on a terminal wrapped and coloured.
#pragma once

#include <memory>
#include <ostream>
#include <streambuf>
#include <string>
#include <string_view>

namespace plumbline::terminal {

// Text for a terminal: its width, colours, and wrapped lines.

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

/// While an object of this class exists, everything printed to the stream passes terminal::Shown(),
/// so that no file's content can control the terminal; only Exact text for a file or pipe does not.
/// On a terminal, the lines that follow ForReading are wrapped at its width (WrappedLine), and
/// ShowsColours() returns whether it shows colours. A line that starts with ReplacedLine()
/// (progress) is not wrapped.
class TerminalOutput {
 public:
  /// @param descriptor  STDOUT_FILENO or STDERR_FILENO
  TerminalOutput(std::ostream& stream, int descriptor);
  /// For a terminal of this width; 0 if it is not a terminal.
  TerminalOutput(std::ostream& stream, int columns, bool colours);
  ~TerminalOutput();
  TerminalOutput(const TerminalOutput&) = delete;
  TerminalOutput& operator=(const TerminalOutput&) = delete;

 private:
  std::ostream& stream_;
  std::streambuf* target_;
  std::unique_ptr<std::streambuf> filter_;
};

/// Manipulator: the output that follows is text to be read. Do not use it before JSON, CSV or TOML,
/// which the user may copy from the terminal.
std::ostream& ForReading(std::ostream& stream);

/// Prints CSV or TOML for another program: byte by byte, unless the stream is a terminal.
void PrintExactly(std::ostream& stream, std::string_view text);

/// True if text printed to the stream may contain colours. NO_COLOR (not empty) and TERM=dumb
/// disable colours.
bool ShowsColours(std::ostream& stream);

}  // namespace plumbline::terminal
