// What the expressions of RAPID stand for, without running the program.
//
// One principle for all: a name that has no fixed value stands for every value that it may have. A
// parameter stands for the arguments of a call, an element with an index that is computed stands
// for all elements, a variable stands for what is assigned to it anywhere, a function for what it
// returns.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "app/programs/brands/rapid_declarations.h"

namespace plumbline::programs::rapid {

/// A part of a data object: `cells{3}.pick`.
struct Part {
  struct Step {
    std::string field;         ///< lower case; "" for an index
    std::optional<int> index;  ///< from 1; absent: known only at run time
  };
  std::size_t data = kNowhere;
  std::vector<Step> steps;
};

/// What a parameter stands for.
struct Binding {
  std::vector<Target> targets;     ///< of a robtarget or jointtarget
  std::optional<Setting> setting;  ///< of a tool, work object or load
  std::optional<double> number;    ///< of a num
  std::optional<Part> part;        ///< of anything else that is declared
  std::string word;                ///< a name that is not declared: `fine`
};

/// A routine with the values of its parameters at some of its calls.
struct Instance {
  std::size_t routine = kNowhere;
  std::map<std::string, Binding> bound;  ///< absent: an optional argument that is not given
  std::string label;
};

/// Where an expression stands.
struct Context {
  Scope scope;
  const Instance* instance = nullptr;
};

/// An argument of an instruction or routine.
struct Argument {
  std::string name;          ///< of an optional argument, lower case; "" of a required one
  Range value;               ///< empty: a switch
  bool conditional = false;  ///< `\WObj?wobj`: present if the parameter is
};
std::vector<Argument> ArgumentsOf(Range range);

inline bool IsPointType(const std::string& type) {
  return type == "robtarget" || type == "jointtarget";
}
inline bool IsFrameType(const std::string& type) {
  return type == "tooldata" || type == "wobjdata" || type == "loaddata";
}

class Values {
 public:
  /// More values than this are not followed.
  static constexpr std::size_t kMostValues = 1000;

  Values(const Declarations& declarations, Program& program);

  /// The value of a num expression of literals and constants.
  std::optional<double> ConstantOf(Range range, const Context& context);
  /// Type of an expression, lower case; "" if it is not known.
  std::string TypeOf(Range range, const Context& context);
  /// Where an expression of type robtarget or jointtarget may lie. At least one target; more than
  /// kMostValues are computed ones.
  std::vector<Target> TargetsOf(Range range, const Context& context);
  /// The tool, work object or load of an expression. Registers its value in the program.
  Setting SettingOf(Range range, const std::string& type, const Context& context);
  /// The declared data that an expression is a part of; nullopt if it is no such part.
  std::optional<Part> PartOf(const Designator& designator, const Context& context);
  /// Type and remaining dimensions of a part; stops at a robtarget or jointtarget.
  std::pair<std::string, int> TypeOf(const Part& part) const;
  /// True for a whole robtarget or jointtarget, not a part of one.
  bool IsTarget(const Part& part) const;
  /// All points that lie in a part or that the part lies in.
  std::vector<std::size_t> PointsIn(const Part& part);
  /// The initial values that a part may mean; stops at a robtarget or jointtarget.
  std::vector<const Value*> ValuesOf(const Part& part) const;

  /// True if the tool is fixed in the cell or the work object is held by the robot.
  bool Stationary(const Setting& setting) const { return stationary_.count(setting.key) > 0; }
  /// A tool, work object or load has another value at run time.
  void Changed(const Setting& setting, const std::string& why);
  /// Marks data whose value in the file is not the one in force at run time.
  void MarkAssigned();

  const Declarations& declarations() const { return declarations_; }

 private:
  /// TargetsOf(); empty for a variable that is being followed already.
  std::vector<Target> Follow(Range range, const Context& context);
  std::vector<Target> TargetsOfCall(Range range, const Context& context);
  std::vector<Target> TargetsOfPart(const Part& part, const Context& context);
  std::vector<Target> Displaced(Range arguments, bool in_tool, const Context& context);
  std::optional<double> Sum(Range& rest, const Context& context, int depth);
  std::optional<double> Product(Range& rest, const Context& context, int depth);
  std::optional<double> Factor(Range& rest, const Context& context, int depth);
  bool MayBe(const Part& part, const Assignment& assignment) const;
  void Register(const std::string& key, const std::string& type, const Part& part);
  std::string At(const Place& place) const;
  const Parameter* ParameterOf(const std::string& name, const Context& context) const;
  Part::Step StepOf(const Accessor& accessor, const Context& context);

  const Declarations& declarations_;
  Program& program_;
  std::unordered_map<std::size_t, std::optional<double>> constants_;
  std::set<std::string> stationary_;
  std::map<std::string, std::string> changed_;
  std::set<std::size_t> visited_;  ///< data whose values are being collected
  int depth_ = 0;
  int work_ = 0;  ///< left for the expression that is being followed
};

}  // namespace plumbline::programs::rapid
