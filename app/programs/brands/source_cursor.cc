#include "app/programs/brands/source_cursor.h"

#include <algorithm>
#include <charconv>

namespace plumbline::programs {

LineIndex::LineIndex(std::string_view bytes) : bytes_(bytes) {
  std::size_t begin = 0;
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    if (!IsLineEnd(bytes[at])) continue;
    lines_.push_back({begin, at});
    if (bytes[at] == '\r' && at + 1 < bytes.size() && bytes[at + 1] == '\n') ++at;
    begin = at + 1;
  }
  lines_.push_back({begin, bytes.size()});
}

int LineIndex::LineAt(std::size_t offset) const {
  const auto next = std::upper_bound(
      lines_.begin(), lines_.end(), offset,
      [](std::size_t position, const Line& line) { return position < line.begin; });
  return static_cast<int>(next - lines_.begin());
}

std::string_view LineIndex::LineEnd(int line) const {
  const std::size_t next = line < count() ? Begin(line + 1) : bytes_.size();
  return bytes_.substr(End(line), next - End(line));
}

std::string_view LineIndex::UsualLineEnd() const {
  return count() > 1 ? LineEnd(1) : std::string_view("\n");
}

bool IsBlank(char c) {
  return c == ' ' || c == '\t';
}
bool IsLineEnd(char c) {
  return c == '\n' || c == '\r';
}
bool IsDigit(char c) {
  return c >= '0' && c <= '9';
}
bool IsLetter(char c) {
  return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
}
bool IsWordSign(char c) {
  return IsLetter(c) || IsDigit(c) || c == '_';
}

std::string_view TrimBlanks(std::string_view text) {
  while (!text.empty() && IsBlank(text.front())) text.remove_prefix(1);
  while (!text.empty() && IsBlank(text.back())) text.remove_suffix(1);
  return text;
}

namespace {

char LoweredLetter(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

}  // namespace

std::string Lowered(std::string_view text) {
  std::string lowered(text);
  for (char& c : lowered) c = LoweredLetter(c);
  return lowered;
}

bool SameWord(std::string_view a, std::string_view b) {
  return std::ranges::equal(a, b, {}, LoweredLetter, LoweredLetter);
}

bool StartsWithWord(std::string_view text, std::string_view start) {
  return SameWord(text.substr(0, start.size()), start);
}

SourceCursor::SourceCursor(std::string_view bytes, std::size_t file, std::size_t begin,
                           std::size_t end)
    : bytes_(bytes), file_(file), at_(0), end_(std::min(end, bytes.size())) {
  MoveTo(begin);
}

void SourceCursor::MoveTo(std::size_t at) {
  at_ = std::min(at, end_);
}

char SourceCursor::Peek(std::size_t ahead) const {
  return ahead < end_ - at_ ? bytes_[at_ + ahead] : '\0';
}

void SourceCursor::SkipBlanks() {
  while (!AtEnd() && IsBlank(bytes_[at_])) ++at_;
}

void SourceCursor::SkipSpace() {
  while (!AtEnd() && (IsBlank(bytes_[at_]) || IsLineEnd(bytes_[at_]))) ++at_;
}

bool SourceCursor::Take(char c) {
  if (AtEnd() || bytes_[at_] != c) return false;
  ++at_;
  return true;
}

bool SourceCursor::TakeKeyword(std::string_view word) {
  if (!StartsWithWord(Rest(), word) || IsWordSign(Peek(word.size()))) return false;
  at_ += word.size();
  return true;
}

std::string_view SourceCursor::TakeWord(std::string_view also) {
  const std::size_t begin = at_;
  if (IsDigit(Peek())) return {};
  while (!AtEnd() &&
         (IsWordSign(bytes_[at_]) || also.find(bytes_[at_]) != std::string_view::npos)) {
    ++at_;
  }
  return TextFrom(begin);
}

std::optional<Number> SourceCursor::TakeNumber() {
  const std::string_view rest = Rest();
  std::size_t length = 0;
  const auto take_digits = [&] {
    const std::size_t first = length;
    while (length < rest.size() && IsDigit(rest[length])) ++length;
    return length - first;
  };
  const auto take_any = [&](std::string_view signs) {
    const bool found = length < rest.size() && signs.find(rest[length]) != std::string_view::npos;
    if (found) ++length;
    return found;
  };
  const bool plus = rest.starts_with('+');
  take_any("+-");
  std::size_t digits = take_digits();
  if (take_any(".")) digits += take_digits();
  if (digits == 0) return std::nullopt;
  const std::size_t mantissa = length;
  if (take_any("eE")) {
    take_any("+-");
    if (take_digits() == 0) length = mantissa;
  }
  if (length < rest.size() && IsWordSign(rest[length])) return std::nullopt;

  Number number{{file_, at_, at_ + length}, 0};
  const char* const end = rest.data() + length;
  const auto [stop, error] = std::from_chars(rest.data() + (plus ? 1 : 0), end, number.value);
  if (error != std::errc() || stop != end) return std::nullopt;
  at_ += length;
  return number;
}

}  // namespace plumbline::programs
