// Tokens of a RAPID module, with their places.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "app/programs/brands/source_cursor.h"

namespace plumbline::programs::rapid {

enum class TokenKind : unsigned char {
  kWord,    ///< identifier or keyword; bytes above 127 count as letters
  kNumber,  ///< unsigned
  kText,    ///< "..." with its quotation marks
  kSign,    ///< one of := <> <= >= or a single character
  kEnd,     ///< after the last token
};

struct Token {
  TokenKind kind = TokenKind::kEnd;
  std::size_t begin = 0, end = 0;
};

/// A file as tokens. Comments and the header between %%% are left out.
class TokenFile {
 public:
  /// @param bytes  must outlive the object
  TokenFile(std::string_view bytes, std::size_t file);

  std::size_t file() const { return file_; }
  std::size_t size() const { return tokens_.size(); }  ///< without the end
  /// The end for every index beyond the last token.
  const Token& operator[](std::size_t i) const { return i < tokens_.size() ? tokens_[i] : end_; }
  std::string_view Text(std::size_t i) const {
    return bytes_.substr((*this)[i].begin, (*this)[i].end - (*this)[i].begin);
  }
  /// The source from token `begin` to the token before `end`.
  std::string_view Text(std::size_t begin, std::size_t end) const;
  Place PlaceOf(std::size_t i) const { return {file_, lines_.LineAt((*this)[i].begin)}; }
  bool IsWord(std::size_t i) const { return (*this)[i].kind == TokenKind::kWord; }
  /// A keyword or name in any case.
  bool IsWord(std::size_t i, std::string_view word) const {
    return IsWord(i) && SameWord(Text(i), word);
  }
  bool IsSign(std::size_t i, std::string_view sign) const {
    return (*this)[i].kind == TokenKind::kSign && Text(i) == sign;
  }
  bool IsSign(std::size_t i, char sign) const { return IsSign(i, std::string_view(&sign, 1)); }
  /// The token after the bracket that closes ( [ or { at `i`; the end of the statement if none
  /// does.
  std::size_t AfterBracket(std::size_t i) const { return i < after_.size() ? after_[i] : i + 1; }

 private:
  void MatchBrackets();

  std::string_view bytes_;
  std::size_t file_;
  LineIndex lines_;
  std::vector<Token> tokens_;
  std::vector<std::size_t> after_;  ///< AfterBracket of each token
  Token end_;
};

/// Tokens [begin, end) of a file.
struct Range {
  const TokenFile* file = nullptr;
  std::size_t begin = 0, end = 0;

  bool empty() const { return begin >= end; }
};

}  // namespace plumbline::programs::rapid
