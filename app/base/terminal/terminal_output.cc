#include "app/base/terminal/terminal_output.h"

#include <cstdlib>
#include <string>
#include <string_view>

#include "app/base/terminal/terminal.h"

namespace plumbline::terminal {
namespace {

/// Flags of a stream, which std::ios_base keeps.
int ReadingFlag() {
  static const int flag = std::ios_base::xalloc();
  return flag;
}
int ColourFlag() {
  static const int flag = std::ios_base::xalloc();
  return flag;
}

bool TerminalShowsColours() {
  const char *const off = std::getenv("NO_COLOR"), *const term = std::getenv("TERM");
  return (off == nullptr || *off == '\0') && term != nullptr && std::string_view(term) != "dumb";
}

/// Holds each line until its line feed, then passes it on: harmless, and wrapped if a person reads
/// the stream on a terminal.
class FilteringBuffer : public std::streambuf {
 public:
  /// @param columns  of the terminal; 0 if it is none
  FilteringBuffer(std::ostream& stream, std::streambuf& target, int columns)
      : stream_(stream), target_(target), columns_(static_cast<std::size_t>(columns)) {}
  ~FilteringBuffer() override { PassLine(""); }
  FilteringBuffer(const FilteringBuffer&) = delete;
  FilteringBuffer& operator=(const FilteringBuffer&) = delete;

  bool PassExactly(std::string_view text) {
    return PassLine("") && (columns_ > 0 ? Pass(terminal::Shown(text)) : Pass(text));
  }

 protected:
  int_type overflow(int_type next) override {
    if (traits_type::eq_int_type(next, traits_type::eof())) return traits_type::not_eof(next);
    const char one = traits_type::to_char_type(next);
    return xsputn(&one, 1) == 1 ? next : traits_type::eof();
  }

  std::streamsize xsputn(const char* text, std::streamsize size) override {
    std::string_view left(text, static_cast<std::size_t>(size));
    for (std::size_t end = 0; (end = left.find('\n')) != std::string_view::npos;) {
      line_ += left.substr(0, end);
      left.remove_prefix(end + 1);
      const bool wraps = columns_ > 0 && ForReader() && !Replaces();
      if (wraps) line_ = terminal::WrappedLine(line_, columns_);
      if (!PassLine("\n")) return 0;
    }
    line_ += left;
    return size;
  }

  /// Standard error is flushed after every insertion, so the start of a line waits for its end.
  int sync() override {
    const bool waits = columns_ > 0 && ForReader() && !Replaces();
    return waits || PassLine("") ? target_.pubsync() : -1;
  }

 private:
  bool ForReader() const { return stream_.iword(ReadingFlag()) != 0; }
  bool Replaces() const { return line_.starts_with(terminal::ReplacedLine()); }
  bool PassLine(std::string_view end) {
    const bool passed = Pass(terminal::Shown(line_)) && Pass(end);
    line_.clear();
    return passed;
  }
  bool Pass(std::string_view text) {
    const auto size = static_cast<std::streamsize>(text.size());
    return target_.sputn(text.data(), size) == size;
  }

  std::ostream& stream_;
  std::streambuf& target_;
  std::size_t columns_;
  std::string line_;
};

}  // namespace

TerminalOutput::TerminalOutput(std::ostream& stream, int descriptor)
    : TerminalOutput(stream, terminal::TerminalColumns(descriptor),
                     terminal::TerminalColumns(descriptor) > 0 && TerminalShowsColours()) {}

TerminalOutput::TerminalOutput(std::ostream& stream, int columns, bool colours)
    : stream_(stream), target_(stream.rdbuf()) {
  stream_.iword(ColourFlag()) = colours ? 1 : 0;
  filter_ = std::make_unique<FilteringBuffer>(stream, *target_, columns);
  stream_.rdbuf(filter_.get());
}

TerminalOutput::~TerminalOutput() {
  filter_.reset();
  stream_.rdbuf(target_);
  stream_.flush();
}

std::ostream& ForReading(std::ostream& stream) {
  stream.iword(ReadingFlag()) = 1;
  return stream;
}

void PrintExactly(std::ostream& stream, std::string_view text) {
  auto* const filter = dynamic_cast<FilteringBuffer*>(stream.rdbuf());
  if (filter == nullptr) {
    stream << text;
  } else if (!filter->PassExactly(text)) {
    stream.setstate(std::ios_base::badbit);
  }
}

bool ShowsColours(std::ostream& stream) {
  return stream.iword(ColourFlag()) != 0;
}

}  // namespace plumbline::terminal
