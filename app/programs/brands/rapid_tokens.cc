#include "app/programs/brands/rapid_tokens.h"

#include <algorithm>

namespace plumbline::programs::rapid {

namespace {

bool IsNameSign(char c) {
  return IsWordSign(c) || static_cast<unsigned char>(c) > 127;
}

/// The end of the number at `at`: digits, a fraction and an exponent, or a based number (0x1F).
std::size_t NumberEnd(std::string_view bytes, std::size_t at) {
  const auto digits = [&] {
    while (at < bytes.size() && IsDigit(bytes[at])) ++at;
  };
  const auto sign = [&](std::size_t i) { return i < bytes.size() ? bytes[i] : '\0'; };
  if (bytes[at] == '0' && (sign(at + 1) == 'x' || sign(at + 1) == 'b' || sign(at + 1) == 'o')) {
    at += 2;
    while (at < bytes.size() && IsWordSign(bytes[at])) ++at;
    return at;
  }
  digits();
  if (sign(at) == '.') ++at, digits();
  if (sign(at) == 'E' || sign(at) == 'e') {
    const std::size_t first = at + (sign(at + 1) == '+' || sign(at + 1) == '-' ? 2 : 1);
    if (IsDigit(sign(first))) at = first, digits();
  }
  return at;
}

/// The end of the string at `at`; two quotation marks are one character of it. A line end closes
/// a string that nothing else does.
std::size_t StringEnd(std::string_view bytes, std::size_t at) {
  for (++at; at < bytes.size() && !IsLineEnd(bytes[at]); ++at) {
    if (bytes[at] != '"') continue;
    if (at + 1 >= bytes.size() || bytes[at + 1] != '"') return at + 1;
    ++at;
  }
  return at;
}

/// The end of the header `%%% VERSION:1 LANGUAGE:ENGLISH %%%` at `at`; `at` if there is none.
std::size_t HeaderEnd(std::string_view bytes, std::size_t at) {
  if (bytes.substr(at, 3) != "%%%") return at;
  const std::size_t close = bytes.substr(0, at + 500).find("%%%", at + 3);
  return close == std::string_view::npos ? at + 3 : close + 3;
}

}  // namespace

TokenFile::TokenFile(std::string_view bytes, std::size_t file)
    : bytes_(bytes), file_(file), lines_(bytes) {
  end_.begin = end_.end = bytes.size();
  const bool byte_order_mark = bytes.substr(0, 3) == "\xEF\xBB\xBF";
  for (std::size_t at = byte_order_mark ? 3 : 0; at < bytes.size();) {
    const char c = bytes[at];
    Token token{TokenKind::kSign, at, at + 1};
    if (static_cast<unsigned char>(c) <= ' ') {
      ++at;
      continue;
    }
    if (c == '!') {
      while (at < bytes.size() && !IsLineEnd(bytes[at])) ++at;
      continue;
    }
    if (c == '%' && HeaderEnd(bytes, at) != at) {
      at = HeaderEnd(bytes, at);
      continue;
    }
    if (IsDigit(c) || (c == '.' && at + 1 < bytes.size() && IsDigit(bytes[at + 1]))) {
      token.kind = TokenKind::kNumber;
      token.end = NumberEnd(bytes, at);
    } else if (c == '"') {
      token.kind = TokenKind::kText;
      token.end = StringEnd(bytes, at);
    } else if (IsNameSign(c)) {
      token.kind = TokenKind::kWord;
      while (token.end < bytes.size() && IsNameSign(bytes[token.end])) ++token.end;
    } else {
      const std::string_view two = bytes.substr(at, 2);
      if (two == ":=" || two == "<>" || two == "<=" || two == ">=") token.end = at + 2;
    }
    tokens_.push_back(token);
    at = token.end;
  }
  MatchBrackets();
}

void TokenFile::MatchBrackets() {
  std::vector<std::size_t> open;
  const auto close_all = [&](std::size_t at) {
    for (const std::size_t i : open) after_[i] = at;
    open.clear();
  };
  after_.resize(tokens_.size());
  for (std::size_t i = 0; i < tokens_.size(); ++i) {
    after_[i] = i + 1;
    if (tokens_[i].kind != TokenKind::kSign) continue;
    const char c = bytes_[tokens_[i].begin];
    if (c == '(' || c == '[' || c == '{') open.push_back(i);
    if (c == ';') close_all(i);
    if ((c == ')' || c == ']' || c == '}') && !open.empty()) {
      after_[open.back()] = i + 1;
      open.pop_back();
    }
  }
  close_all(tokens_.size());
}

std::string_view TokenFile::Text(std::size_t begin, std::size_t end) const {
  if (begin >= end) return {};
  const std::size_t first = (*this)[begin].begin;
  return bytes_.substr(first, (*this)[end - 1].end - first);
}

}  // namespace plumbline::programs::rapid
