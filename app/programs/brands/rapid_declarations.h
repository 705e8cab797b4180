// Declarations of RAPID modules: data with their initial values, records and routines.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "app/programs/brands/rapid_tokens.h"
#include "app/programs/program.h"

namespace plumbline::programs::rapid {

inline constexpr std::size_t kNowhere = static_cast<std::size_t>(-1);

/// An initial value or an aggregate: [parts], a number with its sign, or any other expression.
struct Value {
  Range range;
  std::vector<Value> parts;
  std::optional<Number> number;
  std::optional<std::size_t> point;  ///< the robtarget or jointtarget that it is
  bool aggregate = false;
};

/// Reads an expression; aggregates nested deeper than kMaxNesting become expressions.
Value ValueOf(Range range);

/// The arguments or elements of a range, split at the commas outside brackets.
std::vector<Range> SplitAtCommas(Range range);

/// One step into a value: `{expression, ...}` or `.field`.
struct Accessor {
  std::string field;  ///< lower case; "" for an index
  Range index;
};

/// A name with its accessors: `cell{i}.pick.trans.z`.
struct Designator {
  std::string name;  ///< lower case
  std::vector<Accessor> accessors;
  Range range;
};
/// The designator that starts at a word, up to `end`; an index with commas becomes several.
Designator DesignatorAt(const TokenFile& file, std::size_t at, std::size_t end);

/// `designator := value` somewhere in a routine.
struct Assignment {
  Designator target;
  Range value;
  std::size_t routine = kNowhere;
};

/// Where a declaration is visible: in its routine, in its module if LOCAL, otherwise everywhere.
struct Scope {
  std::size_t module = kNowhere;
  std::size_t routine = kNowhere;  ///< kNowhere: declared in the module
  bool local = false;
  bool task = false;  ///< TASK PERS: not shared with other tasks
};

struct Data {
  std::string name;
  std::string type;  ///< lower case
  bool constant = false, persistent = false;
  int dimensions = 0;
  Scope scope;
  Place place;
  std::optional<Value> value;
  std::vector<Assignment> assigned;
};

struct Parameter {
  std::string name, type;  ///< lower case; type "switch" has no value
  int dimensions = 0;
  bool optional = false;
  bool by_reference = false;  ///< INOUT, VAR or PERS: an assignment changes the argument
  bool assigned = false;      ///< the routine assigns to it
};

struct RoutineText {
  std::string name;
  std::string type;  ///< of a function; "" otherwise
  bool trap = false;
  Scope scope;
  Place place;
  std::vector<Parameter> parameters;
  Range body;
  std::vector<Range> returns;  ///< the expressions of RETURN
  bool handles_errors = false, handles_backward = false, handles_undo = false;
};

/// All modules of a program. Names are found in the order of RAPID: the routine, the module, then
/// what is global.
class Declarations {
 public:
  /// Reads all files; the points that they contain are added to `program`.
  Declarations(const std::deque<TokenFile>& files, Program& program);

  /// Fields of a record or of a built-in type with parts, in their order; null if it has none.
  const std::vector<std::pair<std::string, std::string>>* FieldsOf(const std::string& type) const;
  /// True if a value of this type contains a robtarget or jointtarget.
  bool HoldsPoints(const std::string& type) const;

  /// Index of the data or routine that a name means; nullopt if none, or if several modules
  /// declare it and none of them is this one.
  std::optional<std::size_t> FindData(const std::string& name, const Scope& from) const;
  std::optional<std::size_t> FindRoutine(const std::string& name, const Scope& from) const;
  bool DeclaresRoutine(const std::string& name) const { return routines_by_name_.contains(name); }

  /// The robtarget or jointtarget that is written at a `[`.
  std::optional<std::size_t> PointAt(const TokenFile& file, std::size_t token) const;

  std::vector<Data> data;
  std::vector<RoutineText> routines;

 private:
  void ReadFile(const TokenFile& file);
  void FindLiterals(const TokenFile& file, Program& program);
  std::size_t ReadData(const TokenFile& file, std::size_t at, Scope scope);
  std::size_t ReadRecord(const TokenFile& file, std::size_t at);
  std::size_t ReadRoutine(const TokenFile& file, std::size_t at, Scope scope);
  void ReadBody(const TokenFile& file, std::size_t routine);
  void AttachPoints(Value& value);
  void NamePoints(const Value& value, const std::string& type, int dimensions,
                  const std::string& path, Program& program) const;
  void AttachAssignments();

  using Fields = std::vector<std::pair<std::string, std::string>>;
  std::map<std::string, Fields> records_;
  mutable std::map<std::string, bool> holds_points_;
  std::unordered_map<std::string, std::vector<std::size_t>> data_by_name_, routines_by_name_;
  std::vector<std::unordered_map<std::size_t, std::size_t>> literals_;  ///< by file: token, point
  std::vector<Assignment> assignments_;
  std::size_t modules_ = 0;
};

}  // namespace plumbline::programs::rapid
