// Standard output and standard error on a terminal: wrapped lines and colours.
#pragma once

#include <memory>
#include <ostream>
#include <streambuf>

namespace plumbline::cli {

/// Prepares a stream for the terminal behind its descriptor; has no effect on files and pipes.
/// While an object of this class exists, the lines that follow ForReading are wrapped at the width
/// of the terminal (WrappedLine), and ShowsColours() returns whether the terminal shows colours. A
/// line that starts with a carriage return (progress) is passed on unchanged.
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
  std::unique_ptr<std::streambuf> wrapping_;
};

/// Manipulator: the output that follows is text to be read. Do not use it before JSON, CSV or TOML,
/// which the user may copy from the terminal.
std::ostream& ForReading(std::ostream& stream);

/// True if text printed to the stream may contain colours. NO_COLOR (not empty) and TERM=dumb
/// disable colours.
bool ShowsColours(std::ostream& stream);

}  // namespace plumbline::cli
