// Everything that the commands print: made harmless, and on a terminal wrapped and coloured.
#pragma once

#include <memory>
#include <ostream>
#include <streambuf>
#include <string_view>

namespace plumbline::terminal {

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
