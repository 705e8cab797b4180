#include "app/base/terminal/terminal_output.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <sys/random.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "app/base/text/text.h"

namespace plumbline::terminal {
namespace {

constexpr int kUsualColumns = 80;
constexpr std::size_t kMaxLabelGaps = 2;  // a line with more is a row of a table

/// Largest column, in per cent of the width, at which a last column of text leaves enough room.
constexpr std::size_t kMaxTextColumn = 60;

/// Start of the program's own escape sequences, "\033[" and a random number.
const std::string& OwnSequence() {
  static const std::string sequence = [] {
    std::uint64_t number = 0;
    while (getrandom(&number, sizeof number, 0) != sizeof number) {
    }
    return fmt::format("\033[{:020};", number);
  }();
  return sequence;
}

/// Length of the escape sequence of a colour at the start of the text; 0 if there is none.
std::size_t EscapeLength(std::string_view text) {
  if (!text.starts_with(OwnSequence())) return 0;
  const auto end = text.find('m');
  return end == std::string_view::npos ? 0 : end + 1;
}

/// Number of gaps after the leading spaces, and the column of the text after the last one.
struct Gaps {
  std::size_t count = 0, text_column = 0;
};

Gaps GapsOf(std::string_view line) {
  Gaps gaps;
  std::size_t k = std::min(line.find_first_not_of(' '), line.size());
  while ((k = line.find("  ", k)) != std::string_view::npos) {
    const std::size_t next = line.find_first_not_of(' ', k);
    if (next == std::string_view::npos) break;
    ++gaps.count;
    gaps.text_column = ColumnsOf(line.substr(0, next));
    k = next;
  }
  return gaps;
}

/// Breaks the text at spaces. @param used  columns already used in the first line
std::string Broken(std::string_view text, std::size_t used, std::size_t indent,
                   std::size_t columns) {
  std::string broken;
  std::size_t column = used;
  bool line_is_empty = true;
  while (true) {
    const std::size_t from = text.find_first_not_of(' ');
    if (from == std::string_view::npos) return broken;
    const std::size_t to = std::min(text.find(' ', from), text.size());
    const std::string_view word = text.substr(from, to - from);
    const std::size_t gap = line_is_empty ? 0 : from, width = ColumnsOf(word);
    if (!line_is_empty && column + gap + width > columns) {
      broken += '\n' + std::string(indent, ' ');
      column = indent;
    } else {
      broken += std::string(gap, ' ');
      column += gap;
    }
    broken += word;
    column += width;
    line_is_empty = false;
    text.remove_prefix(to);
  }
}

}  // namespace

int TerminalColumns(int descriptor) {
  if (isatty(descriptor) == 0) return 0;
  winsize size{};
  if (ioctl(descriptor, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) return size.ws_col;
  const char* const declared = std::getenv("COLUMNS");
  const int columns = declared == nullptr ? 0 : std::atoi(declared);
  return columns > 0 ? columns : kUsualColumns;
}

std::string Painted(std::string_view text, Tone tone, bool colours) {
  if (!colours) return std::string(text);
  const char* const colour = tone == Tone::kGood ? "32" : tone == Tone::kWarning ? "33" : "31";
  return fmt::format("{0}{1}m{2}{0}0m", OwnSequence(), colour, text);
}

std::string ReplacedLine() {
  return OwnSequence() + "K";
}

std::string Shown(std::string_view text) {
  std::string shown;
  for (;;) {
    const std::size_t own = text.find(OwnSequence());
    shown += text::Visible(text.substr(0, own));
    if (own == std::string_view::npos) return shown;
    text.remove_prefix(own + OwnSequence().size());
    shown += text.starts_with('K') ? "\r\033[" : "\033[";
    const std::size_t end = std::min(text.find_first_not_of("0123456789"), text.size() - 1);
    shown += text.substr(0, end + 1);
    text.remove_prefix(end + 1);
  }
}

std::size_t ColumnsOf(std::string_view text) {
  std::size_t columns = 0;
  while (!text.empty()) {
    const std::size_t escape = EscapeLength(text);
    // Bytes 10xxxxxx continue a UTF-8 character.
    if (escape == 0 && (static_cast<unsigned char>(text.front()) & 0xC0U) != 0x80U) ++columns;
    text.remove_prefix(std::max<std::size_t>(escape, 1));
  }
  return columns;
}

std::string WrappedLine(std::string_view line, std::size_t columns) {
  if (ColumnsOf(line) <= columns) return std::string(line);
  const Gaps gaps = GapsOf(line);
  const bool labelled = gaps.count > 0 && gaps.text_column <= kMaxTextColumn * columns / 100;
  if (gaps.count > kMaxLabelGaps && !labelled) return std::string(line);
  const std::size_t lead = std::min(line.find_first_not_of(' '), line.size());
  const std::size_t indent = labelled ? gaps.text_column : std::min(lead + 2, columns / 2);
  return std::string(lead, ' ') + Broken(line.substr(lead), lead, indent, columns);
}

std::string WrappedParagraph(std::string_view text, std::size_t columns, std::size_t indent) {
  std::string one_line(text);
  std::replace(one_line.begin(), one_line.end(), '\n', ' ');
  return Broken(one_line, indent, indent, indent + columns);
}

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
