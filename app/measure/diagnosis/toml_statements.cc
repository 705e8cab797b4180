#include "app/measure/diagnosis/toml_statements.h"

#include <algorithm>

namespace plumbline::measure {
namespace {

/// Finds the end of one statement, skipping newlines inside strings and brackets.
class Scanner {
 public:
  Scanner(std::string_view text, std::size_t at) : text_(text), at_(at) {}

  /// Position after the newline that ends the statement.
  std::size_t End() {
    int depth = 0;
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '"' || c == '\'') {
        SkipString(c);
        continue;
      }
      if (c == '#') {
        at_ = std::min(text_.find('\n', at_), text_.size());
        continue;
      }
      if (c == '[' || c == '{') ++depth;
      if (c == ']' || c == '}') --depth;
      ++at_;
      if (c == '\n' && depth <= 0) break;
    }
    return at_;
  }

 private:
  void SkipString(char quote) {
    const std::string three(3, quote);
    const bool multi_line = text_.substr(at_, 3) == three;
    at_ += multi_line ? 3 : 1;
    while (at_ < text_.size()) {
      if (text_[at_] == '\\' && quote == '"') {
        at_ += 2;
        continue;
      }
      if (multi_line ? text_.substr(at_, 3) == three : text_[at_] == quote) break;
      ++at_;
    }
    at_ = std::min(at_ + (multi_line ? 3 : 1), text_.size());
    // Up to two quotes may directly precede the closing three.
    while (multi_line && at_ < text_.size() && text_[at_] == quote) ++at_;
  }

  std::string_view text_;
  std::size_t at_;
};

/// The first part of a dotted key at the start of text: `domain` of `domain.q_deg`, `"domain"`.
std::string FirstKey(std::string_view text) {
  const auto start = text.find_first_not_of(" \t[");
  if (start == std::string_view::npos) return "";
  text.remove_prefix(start);
  if (text.front() == '"' || text.front() == '\'') {
    return std::string(text.substr(1, text.find(text.front(), 1) - 1));
  }
  return std::string(text.substr(0, text.find_first_of(" \t.=]\r\n")));
}

}  // namespace

std::vector<TomlStatement> TomlStatements(std::string_view text) {
  std::vector<TomlStatement> statements;
  std::size_t at = text.starts_with("\xEF\xBB\xBF") ? 3 : 0;
  if (at > 0) statements.push_back({TomlStatement::Kind::kOther, "", text.substr(0, at)});
  while (at < text.size()) {
    const std::size_t end = Scanner(text, at).End();
    TomlStatement& statement = statements.emplace_back();
    statement.text = text.substr(at, end - at);
    at = end;
    const auto first = statement.text.find_first_not_of(" \t\r\n");
    if (first == std::string_view::npos || statement.text[first] == '#') continue;
    statement.kind = statement.text[first] == '[' ? TomlStatement::Kind::kHeader
                                                  : TomlStatement::Kind::kKeyValue;
    statement.first_key = FirstKey(statement.text);
  }
  return statements;
}

std::string WithoutTable(std::string_view text, std::string_view name) {
  using Kind = TomlStatement::Kind;
  std::string kept;
  std::string pending;  // trailing blank lines and comments of a removed table
  bool in_root = true, inside = false;
  for (const TomlStatement& statement : TomlStatements(text)) {
    if (statement.kind == Kind::kHeader) {
      in_root = false;
      inside = statement.first_key == name;
      if (!inside) kept += pending;
      pending.clear();
      if (inside) continue;
    }
    if (inside) {
      if (statement.kind == Kind::kOther) {
        pending += statement.text;
      } else {
        pending.clear();
      }
      continue;
    }
    if (in_root && statement.kind == Kind::kKeyValue && statement.first_key == name) continue;
    kept += statement.text;
  }
  return kept + pending;
}

}  // namespace plumbline::measure
