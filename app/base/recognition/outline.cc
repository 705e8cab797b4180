#include "app/base/recognition/outline.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "app/base/recognition/scans.h"
#include "app/base/text/text_encoding.h"

namespace plumbline::recognition {
namespace {

constexpr std::size_t kSample = 64 * 1024;
constexpr std::size_t kLongestLine = 2000;  // of the head; the rest of a longer one is left out
constexpr std::size_t kMostNumbers = 4096;

char Lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

bool IsUtf16(std::string_view bytes) {
  return bytes.starts_with("\xFF\xFE") || bytes.starts_with("\xFE\xFF");
}

/// Text has hardly any control characters; 0x1A ends files of DOS.
bool IsBinary(std::string_view bytes) {
  if (IsUtf16(bytes)) return false;
  const std::string_view sample = bytes.substr(0, kSample);
  std::size_t control = 0;
  for (const char c : sample) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte == 0) return true;
    control += byte < 0x20 && (byte < 0x09 || byte > 0x0D) && byte != 0x1A && byte != 0x1B ? 1 : 0;
  }
  return control > 1 + sample.size() / 500;
}

/// Lines of the head that look like `key = value` or [header], and like `key: value` or `- item`,
/// and all that are no comment.
struct KeyVotes {
  int toml = 0, yaml = 0, lines = 0;
};

KeyVotes VotesOf(const std::vector<Line>& head) {
  KeyVotes votes;
  for (const Line& line : head) {
    if (line.text.front() == '#') continue;
    ++votes.lines;
    if (line.text.starts_with("- ")) {
      ++votes.yaml;
      continue;
    }
    const std::size_t sign = line.text.find_first_of(":=");
    const bool header = line.text.front() == '[' && line.text.back() == ']';
    if (header) ++votes.toml;
    if (sign == std::string_view::npos || header || sign == 0) continue;
    if (line.text[sign] == '=') {
      ++votes.toml;
    } else if (sign + 1 == line.text.size() || line.text[sign + 1] == ' ') {
      ++votes.yaml;
    }
  }
  return votes;
}

}  // namespace

bool StartsWith(std::string_view text, std::string_view start) {
  return text.size() >= start.size() &&
         std::equal(start.begin(), start.end(), text.begin(),
                    [](char a, char b) { return Lower(a) == Lower(b); });
}

std::string InLowerCase(std::string_view text) {
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(), Lower);
  return lower;
}

std::string_view Trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n";
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

Outline::Outline(std::string_view bytes, std::string_view name) : bytes_(bytes) {
  const std::size_t slash = name.find_last_of('/');
  name_ = InLowerCase(slash == std::string_view::npos ? name : name.substr(slash + 1));
  const std::size_t dot = name_.rfind('.');
  if (dot != std::string::npos) extension_ = name_.substr(dot + 1);
  if (bytes.empty()) {
    syntax_ = Syntax::kEmpty;
    return;
  }
  if (IsBinary(bytes)) {
    syntax_ = Syntax::kBinary;
    return;
  }
  text::DecodedText decoded = text::DecodedFromBytes(bytes);
  text_ = std::move(decoded.text);
  encoding_ = std::move(decoded.encoding);
  line_count_ = static_cast<int>(std::count(text_.begin(), text_.end(), '\n')) +
                (text_.empty() || text_.back() == '\n' ? 0 : 1);
  FindHead();
  ChooseSyntax();
}

void Outline::FindHead() {
  const std::string_view text = text_;
  int number = 1;
  for (std::size_t at = 0; head_.size() < kHeadLines;) {
    const std::size_t begin = text.find_first_not_of(" \t\r\n", at);
    if (begin == std::string_view::npos) return;
    number += static_cast<int>(std::count(text.begin() + static_cast<std::ptrdiff_t>(at),
                                          text.begin() + static_cast<std::ptrdiff_t>(begin), '\n'));
    at = std::min(text.find('\n', begin), text.size());
    head_.push_back({Trimmed(text.substr(begin, std::min(at - begin, kLongestLine))), number});
  }
}

void Outline::ChooseSyntax() {
  if (head_.empty()) {
    syntax_ = Syntax::kEmpty;
    return;
  }
  const auto first_code =
      std::ranges::find_if(head_, [](const Line& line) { return line.text.front() != '#'; });
  const std::string_view first = first_code == head_.end() ? head_.front().text : first_code->text;
  const auto take = [this](Syntax syntax, Scan scan) {
    syntax_ = syntax;
    entries_ = std::move(scan.entries);
    open_at_end_ = std::move(scan.open_at_end);
    if (scan.end >= text_.size()) return;
    std::size_t after = text_.find_first_not_of(" \t\r\n;,", scan.end);
    while (after < text_.size() && text_[after] == '#') {
      after = text_.find_first_not_of(" \t\r\n;,", text_.find('\n', after));
    }
    if (after == std::string::npos) return;
    text_after_ = std::string(Trimmed(std::string_view(text_).substr(after, 40)));
    line_after_ = LineAt(after);
  };
  if (head_.front().text.front() == '<') return take(Syntax::kXml, ScanXml(text_));
  const KeyVotes votes = VotesOf(head_);
  const bool header = first.front() == '[' && first.size() > 1 &&
                      (first[1] == '[' || (first[1] >= 'A' && first[1] <= 'z')) && votes.toml > 0;
  if (first.front() == '{' || (first.front() == '[' && !header)) {
    return take(Syntax::kBraces, ScanBraces(text_));
  }
  if (votes.toml > votes.yaml) {
    take(Syntax::kToml, ScanToml(text_));
  } else if (votes.yaml * 3 >= votes.lines && votes.yaml > 0) {
    take(Syntax::kYaml, ScanYaml(text_));
  }
  const std::size_t whole = std::min(text_.size(), kTableBytes);
  std::string_view sample = std::string_view(text_).substr(0, whole);
  if (whole < text_.size()) sample = sample.substr(0, sample.rfind('\n') + 1);
  table_ = text::LayoutOf(sample, {});
}

const Entry* Outline::Find(std::string_view path) const {
  const auto found = std::ranges::find(entries_, path, &Entry::path);
  return found == entries_.end() ? nullptr : &*found;
}

const Entry* Outline::FindName(std::string_view name) const {
  for (const Entry& entry : entries_) {
    const std::string_view path = entry.path;
    if (path.size() < name.size()) continue;
    const std::size_t at = path.size() - name.size();
    if (at > 0 && path[at - 1] != '.') continue;
    if (StartsWith(path.substr(at), name)) return &entry;
  }
  return nullptr;
}

std::size_t Outline::Count(std::string_view path) const {
  return static_cast<std::size_t>(std::ranges::count(entries_, path, &Entry::path));
}

const Line* Outline::FindLine(std::string_view start) const {
  const auto found =
      std::ranges::find_if(head_, [&](const Line& line) { return StartsWith(line.text, start); });
  return found == head_.end() ? nullptr : &*found;
}

int Outline::LineAt(std::size_t position) const {
  const auto end = text_.begin() + static_cast<std::ptrdiff_t>(std::min(position, text_.size()));
  return 1 + static_cast<int>(std::count(text_.begin(), end, '\n'));
}

std::vector<double> NumbersOf(const Outline& outline, const Entry* entry) {
  std::vector<double> numbers;
  if (entry == nullptr) return numbers;
  const auto& all = outline.entries();
  const Entry* const end = all.data() + all.size();
  // The scalars of a block list follow their key, which has no value of its own.
  const Entry* one = entry;
  if (one->value.empty() && one + 1 != end && (one + 1)->path == one->path) ++one;
  for (bool more = true; more && one != end && one->path == entry->path; ++one) {
    more = entry->value.empty();
    std::string_view rest = one->value;
    while (true) {
      const std::size_t first = rest.find_first_not_of(" \t\r\n,[]()");
      if (first == std::string_view::npos) break;
      rest.remove_prefix(first);
      if (rest.front() == '#') {
        rest.remove_prefix(std::min(rest.find('\n'), rest.size()));
        continue;
      }
      const std::string_view word = rest.substr(0, rest.find_first_of(" \t\r\n,[]()"));
      rest.remove_prefix(word.size());
      std::string_view digits = word;
      if (digits.starts_with("+")) digits.remove_prefix(1);
      double number = 0;
      const auto [stop, error] =
          std::from_chars(digits.data(), digits.data() + digits.size(), number);
      const std::size_t left = static_cast<std::size_t>(digits.data() + digits.size() - stop);
      const bool whole = left == 0 || (left == 1 && *stop == '.');
      if (error != std::errc() || !whole || numbers.size() == kMostNumbers) return {};
      numbers.push_back(number);
    }
  }
  return numbers;
}

std::optional<double> NumberOf(const Outline& outline, const Entry* entry) {
  const std::vector<double> numbers = NumbersOf(outline, entry);
  if (numbers.size() != 1) return std::nullopt;
  return numbers.front();
}

}  // namespace plumbline::recognition
