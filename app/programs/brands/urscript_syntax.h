// Statements and expressions of a URScript file.
//
// Blocks end with `end`; indentation does not count. Nothing fails: what cannot be read becomes an
// expression of kind kOther, of which only the poses written inside it are known.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "app/programs/program.h"

namespace plumbline::programs::urscript {

inline constexpr std::size_t kNone = static_cast<std::size_t>(-1);

enum class ExprKind {
  kNumber,
  kWord,   ///< text, True, False: nothing that moves
  kName,   ///< a variable
  kCall,   ///< name(parts)
  kPose,   ///< p[parts]
  kList,   ///< [parts]
  kIndex,  ///< parts[0] [ parts[1] ]
  kSign,   ///< - parts[0]
  kBinary,
  kOther,
};

struct Expr {
  ExprKind kind = ExprKind::kOther;
  std::size_t begin = 0, end = 0;  ///< bytes of the file
  int line = 0;
  std::size_t routine = 0;  ///< index of the routine in which it stands
  double number = 0;        ///< kNumber
  char sign = 0;            ///< kBinary: + - * /, 0 for all others
  std::string_view name;    ///< kName, kCall
  std::vector<std::size_t> parts;
  std::vector<std::string_view> part_names;  ///< kCall: "" for an argument without name
};

enum class StatementKind {
  kExpression,
  kAssign,         ///< name = expr
  kElementAssign,  ///< name[..] = expr, name.x = expr
  kIf,
  kElif,
  kElse,
  kWhile,
  kOtherBlock,  ///< a block with an unknown first word: its lines may be repeated or left out
  kRoutine,     ///< def, thread, sec
  kEnd,
  kBreak,
  kContinue,
  kReturn,
  kHalt,
  kRun,  ///< starts a thread
};

struct Statement {
  StatementKind kind = StatementKind::kExpression;
  std::size_t begin = 0, end = 0;
  int line = 0;
  std::size_t routine = 0;    ///< in which it stands; of kRoutine, the outer one
  std::size_t opens = kNone;  ///< kRoutine: the routine that it begins
  std::size_t expr = kNone;   ///< condition, right side, value
  std::string_view name;      ///< left side
  bool local = false;         ///< declared with `local`
  bool global = false;
};

struct Parameter {
  std::string_view name;
  std::size_t standard = kNone;  ///< expression of the default value
};

struct RoutineHead {
  std::string_view name;  ///< empty: statements outside all routines
  bool thread = false;
  std::size_t outer = kNone;
  int line = 1;
  std::vector<Parameter> parameters;
};

/// A file. Texts are views of its bytes.
struct Syntax {
  std::vector<RoutineHead> routines;  ///< the first is the file itself
  std::vector<Statement> statements;
  std::vector<Expr> exprs;
  std::vector<Remark> remarks;  ///< lines that are not understood
};

/// Reads the bytes of a file in one pass; linear in their number.
Syntax Parse(std::string_view bytes, std::size_t file);

}  // namespace plumbline::programs::urscript
