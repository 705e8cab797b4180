#include "app/base/text/nesting.h"

#include <fmt/format.h>

#include <array>

namespace plumbline::text {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

/// Read position in a text, with its line number.
class Cursor {
 public:
  explicit Cursor(std::string_view text) : text_(text) {
    if (text_.starts_with(kByteOrderMark)) text_.remove_prefix(kByteOrderMark.size());
  }

  bool AtEnd() const { return at_ == text_.size(); }
  char Here() const { return AtEnd() ? '\0' : text_[at_]; }
  bool Starts(std::string_view with) const { return text_.substr(at_).starts_with(with); }
  int line() const { return line_; }

  void Advance() {
    if (AtEnd()) return;
    if (text_[at_] == '\n') ++line_;
    ++at_;
  }
  void Advance(std::size_t count) {
    for (; count > 0; --count) Advance();
  }
  void SkipLine() {
    while (!AtEnd() && Here() != '\n') Advance();
  }

 private:
  std::string_view text_;
  std::size_t at_ = 0;
  int line_ = 1;
};

/// Skips a TOML string of any of the four kinds, from its first delimiter.
void SkipTomlString(Cursor& cursor) {
  const char quote = cursor.Here();
  const std::string_view fence = quote == '"' ? R"(""")" : "'''";
  const bool multi_line = cursor.Starts(fence);
  cursor.Advance(multi_line ? fence.size() : 1);
  while (!cursor.AtEnd()) {
    if (quote == '"' && cursor.Here() == '\\') {
      cursor.Advance(2);
    } else if (multi_line && cursor.Starts(fence)) {
      cursor.Advance(fence.size());
      // Up to two quotes before the closing fence belong to the text.
      for (int k = 0; k < 2 && cursor.Here() == quote; ++k) cursor.Advance();
      return;
    } else if (!multi_line && (cursor.Here() == quote || cursor.Here() == '\n')) {
      if (cursor.Here() == quote) cursor.Advance();
      return;
    } else {
      cursor.Advance();
    }
  }
}

/// Stack of the open brackets and the number of levels that each contributes.
class Brackets {
 public:
  int depth() const { return depth_; }
  bool empty() const { return count_ == 0; }
  bool InTable() const { return count_ > 0 && open_[count_ - 1].table; }

  /// Adds one level for a bracket. The caller has checked the depth against the limit.
  void Open(bool table) {
    open_[count_++] = {table, 1};
    ++depth_;
  }
  /// Replaces the levels of the innermost table's previous key by those of the current one.
  void SetKeyParts(int parts) {
    Level& level = open_[count_ - 1];
    depth_ += 1 + parts - level.levels;
    level.levels = 1 + parts;
  }
  void Close() {
    if (count_ > 0) depth_ -= open_[--count_].levels;
  }

 private:
  struct Level {
    bool table = false;
    int levels = 0;
  };
  std::array<Level, kMaxNestingDepth + 1> open_{};
  std::size_t count_ = 0;
  int depth_ = 0;
};

/// Minimal TOML scanner: keys, strings, comments and brackets.
class TomlNesting {
 public:
  explicit TomlNesting(std::string_view text) : cursor_(text) {}

  std::optional<int> LineTooDeep() {
    while (!cursor_.AtEnd() && !too_deep_) ReadStatement();
    return too_deep_;
  }

 private:
  void CheckDepth(int depth) {
    if (depth > kMaxNestingDepth) too_deep_ = cursor_.line();
  }

  /// Reads a key up to its delimiter. @return the number of its dotted parts
  int KeyParts() {
    int parts = 0;
    bool part = false;
    while (!cursor_.AtEnd() && parts <= kMaxNestingDepth) {
      const char here = cursor_.Here();
      if (std::string_view("=[]{},#\n").find(here) != std::string_view::npos) break;
      if (here == '"' || here == '\'') {
        SkipTomlString(cursor_);
        part = true;
        continue;
      }
      part = part || (here != ' ' && here != '\t');
      if (here == '.') ++parts;
      cursor_.Advance();
    }
    return parts + (part ? 1 : 0);
  }

  void ReadStatement() {
    const char here = cursor_.Here();
    if (here == ' ' || here == '\t' || here == '\r' || here == '\n') return cursor_.Advance();
    if (here == '#') return cursor_.SkipLine();
    if (here == '[') {
      cursor_.Advance(cursor_.Starts("[[") ? 2 : 1);
      header_parts_ = KeyParts();
      CheckDepth(header_parts_);
      return cursor_.SkipLine();
    }
    const int parts = KeyParts();
    CheckDepth(header_parts_ + parts);
    if (cursor_.Here() != '=') return cursor_.SkipLine();
    ReadValue(header_parts_ + parts);
  }

  /// Reads from the equals sign to the end of the value's last line.
  void ReadValue(int outside) {
    Brackets brackets;
    while (!cursor_.AtEnd() && !too_deep_) {
      const char here = cursor_.Here();
      if (here == '"' || here == '\'') {
        SkipTomlString(cursor_);
        continue;
      }
      if (here == '#') {
        cursor_.SkipLine();
        continue;
      }
      if (here == '\n' && brackets.empty()) return;
      cursor_.Advance();
      if (here == '[' || here == '{') {
        CheckDepth(outside + brackets.depth() + 1);
        if (too_deep_) return;
        brackets.Open(here == '{');
      } else if (here == ']' || here == '}') {
        brackets.Close();
        continue;
      }
      if (here == '{' || (here == ',' && brackets.InTable())) {
        brackets.SetKeyParts(KeyParts());
        CheckDepth(outside + brackets.depth());
      }
    }
  }

  Cursor cursor_;
  int header_parts_ = 0;
  std::optional<int> too_deep_;
};

}  // namespace

std::optional<int> LineNestedTooDeepInToml(std::string_view text) {
  return TomlNesting(text).LineTooDeep();
}

std::optional<int> LineNestedTooDeepInJson(std::string_view text) {
  Cursor cursor(text);
  int depth = 0;
  bool in_string = false;
  for (; !cursor.AtEnd(); cursor.Advance()) {
    const char here = cursor.Here();
    if (in_string && here == '\\') {
      cursor.Advance();
    } else if (here == '"') {
      in_string = !in_string;
    } else if (!in_string && (here == '[' || here == '{')) {
      if (++depth > kMaxNestingDepth) return cursor.line();
    } else if (!in_string && (here == ']' || here == '}')) {
      --depth;
    }
  }
  return std::nullopt;
}

std::string NestedTooDeepText() {
  return fmt::format(
      "nested more than {} levels deep (brackets and dotted keys together); shorten the key or "
      "remove surplus brackets",
      kMaxNestingDepth);
}

}  // namespace plumbline::text
