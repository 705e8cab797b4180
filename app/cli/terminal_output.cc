#include "app/cli/terminal_output.h"

#include <cstdlib>
#include <string>
#include <string_view>

#include "app/terminal/terminal.h"

namespace plumbline::cli {
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

/// Holds each line until its line feed, then passes it on, wrapped if the stream is read by a
/// person.
class WrappingBuffer : public std::streambuf {
 public:
  WrappingBuffer(std::ostream& stream, std::streambuf& target, int columns)
      : stream_(stream), target_(target), columns_(static_cast<std::size_t>(columns)) {}
  ~WrappingBuffer() override { Pass(line_); }
  WrappingBuffer(const WrappingBuffer&) = delete;
  WrappingBuffer& operator=(const WrappingBuffer&) = delete;

 protected:
  int_type overflow(int_type next) override {
    if (traits_type::eq_int_type(next, traits_type::eof())) return traits_type::not_eof(next);
    if (next != '\n') {
      line_ += traits_type::to_char_type(next);
      return next;
    }
    const bool wraps = stream_.iword(ReadingFlag()) != 0 && !line_.starts_with('\r');
    const bool passed = Pass((wraps ? terminal::WrappedLine(line_, columns_) : line_) + "\n");
    line_.clear();
    return passed ? next : traits_type::eof();
  }

  /// Standard error is flushed after every insertion, so the start of a line waits for its end.
  int sync() override {
    if (stream_.iword(ReadingFlag()) == 0 || line_.starts_with('\r')) {
      Pass(line_);
      line_.clear();
    }
    return target_.pubsync();
  }

 private:
  bool Pass(const std::string& text) {
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
  if (columns == 0) return;
  wrapping_ = std::make_unique<WrappingBuffer>(stream, *target_, columns);
  stream_.rdbuf(wrapping_.get());
}

TerminalOutput::~TerminalOutput() {
  if (!wrapping_) return;
  wrapping_.reset();
  stream_.rdbuf(target_);
  stream_.flush();
}

std::ostream& ForReading(std::ostream& stream) {
  stream.iword(ReadingFlag()) = 1;
  return stream;
}

bool ShowsColours(std::ostream& stream) {
  return stream.iword(ColourFlag()) != 0;
}

}  // namespace plumbline::cli
