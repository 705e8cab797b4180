// Modules and variables of a KRL program: what is declared where, with which values, and where it
// is assigned.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "app/programs/brand.h"
#include "app/programs/brands/krl_paths.h"
#include "app/programs/brands/krl_text.h"

namespace plumbline::programs::krl {

/// The numbers X, Y, Z, A, B, C of an aggregate [mm, deg].
using PoseNumbers = std::array<std::optional<Number>, 6>;

/// A value that is written for a variable, or for a part of it.
struct Value {
  Place place;
  std::string_view text;
  std::optional<double> number;
  PoseNumbers pose;
  bool is_pose = false;
  std::optional<std::size_t> point;  ///< in Program::points
};

/// An assignment of the running program.
struct Write {
  std::string path;
  Place place;
  bool literal = false;  ///< of an aggregate that became a Value

  /// True if this assignment is where the value of the part is written.
  bool Makes(const std::string& part, const Value& value) const {
    return literal && path == part && place.line == value.place.line &&
           place.file == value.place.file;
  }
};

/// A variable; its parts are named by paths.
struct Variable {
  std::string name;  ///< as declared
  std::string type;  ///< in small letters
  std::size_t module = 0;
  Place place;
  bool declared = false;
  bool parameter = false;               ///< of a routine: the caller gives its value
  bool shared = false;                  ///< visible to modules other than its own
  std::map<std::string, Value> values;  ///< by path
  std::vector<Write> writes;
};

/// The SRC and the DAT file with the same name.
struct Module {
  std::string name;  ///< as written
  std::optional<std::size_t> src, dat;
  bool is_public = false;
  std::vector<std::size_t> routines;  ///< in Program::routines
  std::unordered_map<std::string, std::size_t> variables, local_routines;
};

/// A variable and the part of it that an expression names.
struct Reference {
  std::optional<std::size_t> variable;
  std::string name;  ///< as written, without indices
  std::string path;
  std::string component;  ///< "x", "a1", "s": a number of a pose, which is not in `path`
};

/// Everything that is declared and assigned in the files of a program; fills Program::points and
/// the names of Program::routines.
class Names {
 public:
  Names(Reading& reading, const std::vector<LineIndex>& lines);

  const std::vector<Module>& modules() const { return modules_; }
  const Variable& variable(std::size_t index) const { return variables_[index]; }
  const std::vector<Variable>& variables() const { return variables_; }
  /// The module of a file; nullopt if it was refused.
  std::optional<std::size_t> ModuleOf(std::size_t file) const { return module_of_file_[file]; }
  /// The routine with this name as seen from a module; nullopt if it was not given.
  std::optional<std::size_t> FindRoutine(std::size_t module, std::string_view name) const;
  /// The variable and part that the tokens from `at` name; `at` is moved behind them.
  Reference TakeReference(const Statement& statement, std::size_t module,
                          std::optional<std::size_t> routine, std::size_t& at) const;
  /// The values whose paths match `path`, where "[*]" matches any index.
  std::vector<const Value*> ValuesAt(const Reference& reference) const;
  const Value* ValueAt(std::size_t variable, const std::string& path) const;
  const Value* GlobalValue(std::string_view name, const std::string& path) const;
  /// The first assignment of the running program to this part, to one around it or in it.
  const Write* WriteTo(std::size_t variable, const std::string& path) const;
  /// The value that a reference has all the time: a single one is written, and no other assigned.
  /// Null if there is none; `write` is then the assignment that changes it, if that is the reason.
  const Value* ConstantValueOf(const Reference& reference, const Write*& write) const;
  std::optional<std::size_t> Global(std::string_view name) const;
  /// A whole number that is written out, or a variable that has this value all the time.
  std::optional<std::int64_t> WholeNumber(const Statement& statement, std::size_t module,
                                          std::optional<std::size_t> routine, std::size_t begin,
                                          std::size_t end) const;

  /// A point for an aggregate inside a statement.
  std::size_t AddPoint(const Aggregate& aggregate, bool joints, std::string name, Place place);
  std::string_view Bytes(std::size_t file) const { return reading_.program.files[file].bytes; }
  /// True if the program has too many parts and uses to follow them all: then none is known.
  bool exhausted() const { return matches_left_ == 0; }
  /// "weld.src:12"
  std::string Shown(const Place& place) const;

 private:
  void FindModules(const std::vector<LineIndex>& lines);
  void ReadDeclarations(const std::vector<LineIndex>& lines);
  void ReadDeclaration(const Statement& statement, std::size_t module,
                       std::optional<std::size_t> routine, bool data);
  void ReadStructure(const Statement& statement);
  void ReadAssignments(const std::vector<LineIndex>& lines);
  void ReadAssignment(const Statement& statement, std::size_t module,
                      std::optional<std::size_t> routine);
  void MarkUntouchable();
  std::size_t Declare(std::string_view name, std::size_t module,
                      std::optional<std::size_t> routine);
  std::optional<std::size_t> Find(std::string_view name, std::size_t module,
                                  std::optional<std::size_t> routine) const;
  std::string TypeAt(const Variable& variable, std::string_view path) const;
  void AddValue(std::size_t variable, const std::string& path, const Statement& statement,
                std::size_t& at);
  void AddAggregate(std::size_t variable, const std::string& path, const Aggregate& aggregate,
                    Place place);

  Reading& reading_;
  std::vector<Module> modules_;
  std::vector<std::optional<std::size_t>> module_of_file_;
  std::vector<Variable> variables_;
  std::vector<std::unordered_map<std::string, std::size_t>> locals_;  ///< by routine
  std::unordered_map<std::string, std::size_t> globals_, global_routines_;
  std::vector<std::pair<std::string, Statement>> imports_;
  std::unordered_map<std::string, std::map<std::string, std::string>> structures_;
  mutable std::size_t matches_left_ = 4000000;  ///< bound of the time for elements that vary
};

}  // namespace plumbline::programs::krl
