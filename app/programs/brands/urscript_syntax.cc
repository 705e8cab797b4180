#include "app/programs/brands/urscript_syntax.h"

#include <algorithm>
#include <array>
#include <utility>

#include "app/programs/brands/source_cursor.h"

namespace plumbline::programs::urscript {

namespace {

enum class TokenKind { kWord, kNumber, kText, kSign, kLineEnd };

struct Token {
  TokenKind kind = TokenKind::kLineEnd;
  std::size_t begin = 0, end = 0;
  double number = 0;
};

/// Tokens of a file without comments and without the `$ n "name"` lines that PolyScope writes for
/// the nodes of its program tree. A line end inside brackets is none.
std::vector<Token> TokensOf(std::string_view bytes, std::size_t file) {
  std::vector<Token> tokens;
  SourceCursor at(bytes, file);
  int depth = 0;
  bool line_begins = true;
  const auto skip_line = [&] {
    while (!at.AtEnd() && !IsLineEnd(at.Peek())) at.Skip();
  };
  while (!at.AtEnd()) {
    at.SkipBlanks();
    const std::size_t begin = at.at();
    const char c = at.Peek();
    if (at.AtEnd()) break;
    if (c == '#' || (c == '$' && line_begins)) {
      skip_line();
      continue;
    }
    if (IsLineEnd(c)) {
      at.Skip();
      if (depth == 0) tokens.push_back({TokenKind::kLineEnd, begin, at.at()});
      line_begins = true;
      continue;
    }
    line_begins = false;
    if (IsDigit(c) || (c == '.' && IsDigit(at.Peek(1)))) {
      if (const std::optional<Number> number = at.TakeNumber()) {
        tokens.push_back({TokenKind::kNumber, begin, at.at(), number->value});
        continue;
      }
    }
    if (!at.TakeWord().empty()) {
      // A method of an object is one name: rpc.method(..).
      while (at.Peek() == '.' && (IsLetter(at.Peek(1)) || at.Peek(1) == '_')) {
        at.Skip();
        at.TakeWord();
      }
      tokens.push_back({TokenKind::kWord, begin, at.at()});
      // A block that is opened inside a bracket that was never closed ends the bracket: one
      // missing sign must not hide the rest of the file.
      const std::string_view word = at.TextFrom(begin);
      if (word == "def" || word == "thread" || word == "end") depth = 0;
      continue;
    }
    at.Skip();
    if (c == '"' || c == '\'') {
      while (!at.AtEnd() && at.Peek() != c && !IsLineEnd(at.Peek())) at.Skip();
      at.Take(c);
      tokens.push_back({TokenKind::kText, begin, at.at()});
      continue;
    }
    if (c == '(' || c == '[' || c == '{') ++depth;
    if (c == ')' || c == ']' || c == '}') depth = std::max(depth - 1, 0);
    tokens.push_back({TokenKind::kSign, begin, at.at()});
  }
  tokens.push_back({TokenKind::kLineEnd, bytes.size(), bytes.size()});
  return tokens;
}

Expr Started(ExprKind kind, std::size_t begin) {
  Expr expr;
  expr.kind = kind;
  expr.begin = begin;
  return expr;
}

/// Operators of one expression, and indices after one value, that are followed.
constexpr std::size_t kMostOperators = 200;
constexpr int kMostIndices = 8;

class Parser {
 public:
  Parser(std::string_view bytes, std::size_t file)
      : bytes_(bytes), file_(file), lines_(bytes), tokens_(TokensOf(bytes, file)) {
    syntax_.routines.emplace_back();
  }

  Syntax Run() {
    while (next_ + 1 < tokens_.size()) {
      if (Now().kind == TokenKind::kLineEnd || Is(";")) {
        ++next_;
        continue;
      }
      const std::size_t before = next_;
      ReadStatement();
      if (next_ == before) ++next_;
    }
    // What was not understood may have been the end.
    if (!syntax_.remarks.empty()) blocks_.clear();
    for (const Block& block : blocks_) {
      syntax_.remarks.push_back({{file_, block.line}, "the `end` of this block is missing", true});
    }
    return std::move(syntax_);
  }

 private:
  const Token& Now(std::size_t ahead = 0) const {
    return tokens_[std::min(next_ + ahead, tokens_.size() - 1)];
  }
  std::string_view Text(const Token& token) const {
    return bytes_.substr(token.begin, token.end - token.begin);
  }
  bool Is(std::string_view text, std::size_t ahead = 0) const {
    const Token& token = Now(ahead);
    return token.kind != TokenKind::kText && Text(token) == text;
  }
  bool Take(std::string_view text) {
    if (!Is(text)) return false;
    ++next_;
    return true;
  }
  bool AtStatementEnd() const { return Now().kind == TokenKind::kLineEnd || Is(";"); }

  std::size_t Add(Expr expr) {
    expr.line = lines_.LineAt(expr.begin);
    expr.routine = routine_;
    syntax_.exprs.push_back(std::move(expr));
    return syntax_.exprs.size() - 1;
  }
  std::size_t End() const { return tokens_[next_ - 1].end; }

  void ReadStatement();
  void ReadRoutine(Statement statement, bool thread);
  void ReadAssignment(Statement& statement);
  std::size_t ReadParts(std::string_view close, Expr& expr);
  std::size_t ReadExpression();
  std::size_t ReadOperand();
  std::size_t ReadPrimary();
  std::size_t SkipStatement();

  std::string_view bytes_;
  std::size_t file_;
  LineIndex lines_;
  std::vector<Token> tokens_;
  std::size_t next_ = 0;
  std::size_t routine_ = 0;
  int depth_ = 0;
  bool failed_ = false;
  struct Block {
    int line = 0;
    bool routine = false;
  };
  std::vector<Block> blocks_;
  Syntax syntax_;
};

/// Everything up to the end of the statement as one expression of which only the poses count.
std::size_t Parser::SkipStatement() {
  Expr other;
  other.begin = Now().begin;
  other.end = other.begin;
  while (!AtStatementEnd()) {
    other.end = Now().end;
    if (Is("p") && Is("[", 1)) {
      ++next_;
      Expr pose = Started(ExprKind::kPose, tokens_[next_ - 1].begin);
      ++next_;
      failed_ = false;
      ReadParts("]", pose);
      if (!failed_) {
        pose.end = End();
        other.parts.push_back(Add(std::move(pose)));
      }
      failed_ = true;
      other.end = End();
    } else {
      ++next_;
    }
  }
  return Add(std::move(other));
}

std::size_t Parser::ReadParts(std::string_view close, Expr& expr) {
  while (!Take(close)) {
    if (AtStatementEnd() || failed_) {
      failed_ = true;
      return 0;
    }
    std::string_view name;
    if (expr.kind == ExprKind::kCall && Now().kind == TokenKind::kWord && Is("=", 1)) {
      name = Text(Now());
      next_ += 2;
    }
    expr.parts.push_back(ReadExpression());
    expr.part_names.push_back(name);
    if (!Take(",") && !Is(close)) failed_ = true;
  }
  return expr.parts.size();
}

std::size_t Parser::ReadPrimary() {
  const Token& token = Now();
  Expr expr;
  expr.begin = token.begin;
  expr.end = token.end;
  NestingLevel level(depth_);
  if (level.too_deep()) failed_ = true;
  if (failed_) return Add(std::move(expr));
  if (token.kind == TokenKind::kNumber) {
    expr.kind = ExprKind::kNumber;
    expr.number = token.number;
    ++next_;
  } else if (token.kind == TokenKind::kText) {
    expr.kind = ExprKind::kWord;
    ++next_;
  } else if (Take("(")) {
    const std::size_t inner = ReadExpression();
    if (!Take(")")) failed_ = true;
    if (!Is("[")) return inner;
    expr = syntax_.exprs[inner];
    // An index of a parenthesis is not followed.
    failed_ = true;
  } else if (Take("[") || Take("{")) {
    expr.kind = ExprKind::kList;
    ReadParts(bytes_[token.begin] == '[' ? "]" : "}", expr);
    expr.end = End();
  } else if (token.kind == TokenKind::kWord) {
    const std::string_view word = Text(token);
    expr.name = word;
    ++next_;
    if (word == "True" || word == "False") {
      expr.kind = ExprKind::kWord;
    } else if (word == "not") {
      expr.kind = ExprKind::kBinary;
      expr.parts.push_back(ReadOperand());
    } else if (Take("(")) {
      expr.kind = ExprKind::kCall;
      ReadParts(")", expr);
    } else if (word == "p" && Take("[")) {
      expr.kind = ExprKind::kPose;
      ReadParts("]", expr);
      if (!failed_ && expr.parts.size() == 1) {  // a variable named p
        Expr variable = Started(ExprKind::kName, token.begin);
        variable.end = token.end;
        variable.name = word;
        expr.parts.insert(expr.parts.begin(), Add(std::move(variable)));
        expr.kind = ExprKind::kIndex;
      }
    } else {
      expr.kind = ExprKind::kName;
    }
    expr.end = End();
  } else {
    failed_ = true;
  }
  std::size_t made = Add(expr);
  for (int indices = 0; !failed_ && Is("["); ++indices) {
    if (indices == kMostIndices) failed_ = true;
    Expr index = Started(ExprKind::kIndex, expr.begin);
    ++next_;
    index.parts = {made, ReadExpression()};
    while (Take(",")) index.parts.push_back(ReadExpression());
    if (!Take("]")) failed_ = true;
    index.end = End();
    made = Add(std::move(index));
  }
  return made;
}

/// A sign and a primary. A sign that touches its number belongs to it.
std::size_t Parser::ReadOperand() {
  NestingLevel level(depth_);
  if (level.too_deep()) failed_ = true;
  if (failed_ || !(Is("-") || Is("+"))) return ReadPrimary();
  const Token sign = Now();
  ++next_;
  if (Now().kind == TokenKind::kNumber && Now().begin == sign.end) {
    const std::size_t number = ReadPrimary();
    Expr& expr = syntax_.exprs[number];
    if (expr.kind == ExprKind::kNumber) {
      expr.begin = sign.begin;
      if (bytes_[sign.begin] == '-') expr.number = -expr.number;
      return number;
    }
  }
  Expr expr = Started(ExprKind::kSign, sign.begin);
  expr.sign = bytes_[sign.begin];
  expr.parts.push_back(ReadOperand());
  expr.end = End();
  return Add(std::move(expr));
}

/// Operands between operators, from left to right with * and / before + and -; other operators
/// bind least and only keep their operands together.
std::size_t Parser::ReadExpression() {
  NestingLevel level(depth_);
  if (level.too_deep()) failed_ = true;
  struct Pending {
    std::size_t operand;
    char sign;
  };
  std::vector<Pending> pending;
  std::size_t operand = ReadOperand();
  const auto strength = [](char sign) {
    return sign == '*' || sign == '/' ? 2 : sign == '+' || sign == '-' ? 1 : 0;
  };
  const auto join = [&](int least) {
    while (!pending.empty() && strength(pending.back().sign) >= least) {
      const auto [left, sign] = pending.back();
      pending.pop_back();
      Expr expr = Started(ExprKind::kBinary, syntax_.exprs[left].begin);
      expr.end = syntax_.exprs[operand].end;
      expr.sign = sign;
      expr.parts = {left, operand};
      operand = Add(std::move(expr));
    }
  };
  for (std::size_t operators = 0; !failed_; ++operators) {
    if (operators == kMostOperators) failed_ = true;
    char sign = 0;
    if (Is("+") || Is("-") || Is("*") || Is("/")) {
      sign = bytes_[Now().begin];
      ++next_;
    } else if (Is("and") || Is("or") || Is("xor") || Is("%") || Is("in")) {
      ++next_;
    } else if (Is("<") || Is(">") || Is("=") || Is("!")) {
      // == <= >= != and, inside an argument that is an assignment, =.
      const bool two = Is("=", 1) && Now(1).begin == Now().end;
      if (!two && !(Is("<") || Is(">"))) break;
      next_ += two ? 2 : 1;
    } else {
      break;
    }
    join(strength(sign));
    pending.push_back({operand, sign});
    operand = ReadOperand();
  }
  join(0);
  return operand;
}

void Parser::ReadAssignment(Statement& statement) {
  // name = .., name[..] = .., name.field = ..
  std::size_t ahead = 1;
  if (Is("[", 1)) {
    int depth = 0;
    for (; Now(ahead).kind != TokenKind::kLineEnd && !Is(";", ahead); ++ahead) {
      if (Is("[", ahead)) ++depth;
      if (Is("]", ahead) && --depth == 0) break;
    }
    ++ahead;
  }
  if (Now().kind != TokenKind::kWord || !Is("=", ahead) ||
      (Is("=", ahead + 1) && Now(ahead + 1).begin == Now(ahead).end)) {
    return;
  }
  const std::string_view word = Text(Now());
  const std::size_t dot = word.find('.');
  statement.name = word.substr(0, dot);
  statement.kind = ahead == 1 && dot == std::string_view::npos ? StatementKind::kAssign
                                                               : StatementKind::kElementAssign;
  next_ += ahead + 1;
}

void Parser::ReadRoutine(Statement statement, bool thread) {
  RoutineHead head;
  head.thread = thread;
  head.outer = routine_;
  head.line = statement.line;
  if (Now().kind == TokenKind::kWord) {
    head.name = Text(Now());
    ++next_;
  }
  const std::size_t inner = syntax_.routines.size();
  syntax_.routines.push_back(std::move(head));
  const std::size_t outer = std::exchange(routine_, inner);
  bool closed = true;
  if (Take("(")) {
    while (!(closed = Take(")")) && !AtStatementEnd()) {
      if (Now().kind != TokenKind::kWord) {
        ++next_;
        continue;
      }
      Parameter parameter;
      parameter.name = Text(Now());
      ++next_;
      if (Take("=")) parameter.standard = ReadExpression();
      syntax_.routines[inner].parameters.push_back(parameter);
      Take(",");
      if (failed_) break;
    }
  }
  if (failed_ || !closed) {
    syntax_.remarks.push_back(
        {{file_, statement.line}, "the head of this routine is not understood", true});
  }
  if (failed_) SkipStatement();
  Take(":");
  routine_ = outer;
  statement.kind = StatementKind::kRoutine;
  statement.opens = inner;
  statement.end = End();
  syntax_.statements.push_back(statement);
  routine_ = inner;
  blocks_.push_back({statement.line, true});
}

void Parser::ReadStatement() {
  Statement statement;
  statement.begin = Now().begin;
  statement.line = lines_.LineAt(statement.begin);
  statement.routine = routine_;
  failed_ = false;
  depth_ = 0;

  const auto finish = [&] {
    if (failed_) {
      next_ = std::max(next_, std::size_t{1});
      const std::size_t rest = SkipStatement();
      if (statement.expr != kNone) syntax_.exprs[rest].parts.push_back(statement.expr);
      statement.expr = rest;
      syntax_.remarks.push_back({{file_, statement.line}, "not understood, left as it is", true});
    }
    statement.end = End();
    syntax_.statements.push_back(statement);
  };

  struct Word {
    std::string_view text;
    StatementKind kind;
  };
  static constexpr std::array<Word, 5> kBlocks = {{{"if", StatementKind::kIf},
                                                   {"elif", StatementKind::kElif},
                                                   {"else", StatementKind::kElse},
                                                   {"while", StatementKind::kWhile},
                                                   {"for", StatementKind::kOtherBlock}}};
  static constexpr std::array<Word, 4> kPlain = {{{"break", StatementKind::kBreak},
                                                  {"continue", StatementKind::kContinue},
                                                  {"halt", StatementKind::kHalt},
                                                  {"end", StatementKind::kEnd}}};
  static constexpr std::array<Word, 2> kValues = {
      {{"return", StatementKind::kReturn}, {"run", StatementKind::kRun}}};

  for (const bool thread : {false, true}) {
    if (Take(thread ? "thread" : "def")) return ReadRoutine(statement, thread);
  }
  if (Is("sec") && Now(1).kind == TokenKind::kWord) {
    ++next_;
    return ReadRoutine(statement, false);
  }
  for (const Word& word : kBlocks) {
    if (!Take(word.text)) continue;
    statement.kind = word.kind;
    if (!Is(":")) statement.expr = ReadExpression();
    if (!failed_ && !Take(":")) {
      while (!AtStatementEnd() && !Is(":")) ++next_;
      Take(":");
    }
    if (word.kind != StatementKind::kElif && word.kind != StatementKind::kElse) {
      blocks_.push_back({statement.line});
    }
    return finish();
  }
  for (const Word& word : kPlain) {
    if (!Take(word.text)) continue;
    statement.kind = word.kind;
    if (word.kind == StatementKind::kEnd) {
      if (blocks_.empty()) {
        syntax_.remarks.push_back({{file_, statement.line}, "this `end` ends no block", true});
        return;
      }
      const bool routine = blocks_.back().routine;
      blocks_.pop_back();
      finish();
      if (routine) routine_ = syntax_.routines[routine_].outer;
      return;
    }
    return finish();
  }
  for (const Word& word : kValues) {
    if (!Take(word.text)) continue;
    statement.kind = word.kind;
    if (!AtStatementEnd()) statement.expr = ReadExpression();
    return finish();
  }
  statement.global = Take("global");
  statement.local = !statement.global && Take("local");
  ReadAssignment(statement);
  if (statement.kind == StatementKind::kExpression && (statement.global || statement.local)) {
    statement.name = Now().kind == TokenKind::kWord ? Text(Now()) : std::string_view();
    if (!AtStatementEnd()) statement.expr = ReadExpression();
    return finish();
  }
  // `x = run thread()` and `x = spawn ..` start a thread.
  if (Take("run")) statement.kind = StatementKind::kRun;
  if (!AtStatementEnd()) statement.expr = ReadExpression();
  if (!failed_ && !AtStatementEnd()) {
    if (Is(":")) {
      statement.kind = StatementKind::kOtherBlock;
      blocks_.push_back({statement.line});
      ++next_;
    } else if (Is("end")) {
      // the block ends on the same line
    } else if (syntax_.exprs[statement.expr].kind != ExprKind::kName) {
      failed_ = true;  // two expressions side by side
    } else {
      ReadExpression();  // a command with a word: `kill thread`, `join handle`
    }
  }
  finish();
}

}  // namespace

Syntax Parse(std::string_view bytes, std::size_t file) {
  return Parser(bytes, file).Run();
}

}  // namespace plumbline::programs::urscript
