// What the expressions of a URScript file can stand for: points, frames, numbers, tables of them.
//
// A variable that is assigned once stands for the right side; one that is assigned several times,
// and a parameter, stands for any of its right sides or arguments. What depends on the robot or on
// inputs is unknown, and every point that goes into it is noted with the reason.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "app/programs/brands/urscript_syntax.h"
#include "app/programs/program.h"

namespace plumbline::programs::urscript {

/// Alternatives of one expression that are followed.
inline constexpr std::size_t kMostAlternatives = 256;

/// A place to which a motion can go: a written pose in a base with an offset, or written joints.
struct Destination {
  std::size_t literal = kNone;  ///< expression of the pose or of the list of joints
  std::string base;             ///< key of the feature; empty: the robot's base
  Pose X_base;                  ///< its pose [m]
  Offset offset{};
  std::vector<double> near_q;  ///< `qnear` [rad]
  std::optional<Pose> tool;    ///< of get_inverse_kin, if it names one
};

struct Value;
using ValuePtr = std::shared_ptr<const Value>;

struct Value {
  enum class Kind { kUnknown, kNumber, kFrame, kDestination, kList, kOneOf } kind = Kind::kUnknown;
  double number = 0;
  Pose X;  ///< kFrame, and a destination by its pose: where it is in the robot's base
  Destination destination{};
  std::vector<ValuePtr> items;
  std::size_t expr = kNone;  ///< kList: where it is written
};

/// A use of a written pose that is no motion.
struct Note {
  std::size_t literal = kNone;
  std::size_t routine = 0;
  int line = 0;
  std::string reason;
};

class Values {
 public:
  /// @param bytes  of the file
  Values(const Syntax& syntax, std::string_view bytes);

  ValuePtr Of(std::size_t expr);
  /// Where an expression can send the robot; a list of six numbers is joints.
  /// @return  one or more alternatives; nullopt where it is computed
  std::vector<std::optional<Destination>> Destinations(std::size_t expr);
  /// The pose that an expression always has.
  std::optional<Pose> ConstantPose(std::size_t expr);
  std::optional<double> ConstantNumber(std::size_t expr);
  std::optional<std::vector<double>> ConstantNumbers(std::size_t expr);
  /// Likewise of a variable of the file.
  std::optional<std::vector<double>> ConstantVariable(std::string_view name);

  /// Notes the poses in the value of an expression as used otherwise than as a target.
  void NoteUse(std::size_t expr, const std::string& reason);
  /// Likewise, but a pose that is written right there is no point at all.
  void NoteConstant(std::size_t expr, const std::string& reason);

  /// An assignment is reached: until Forget(), the variable has this value.
  void Remember(const Statement& assignment);
  void Forget() { recent_.clear(); }

  /// Poses that motions go to as they are written, to tell a point with an offset from a feature;
  /// collected while destinations are asked for, and used from the next reading on.
  const std::set<std::size_t>& direct() const { return direct_; }
  void UseDirect(std::set<std::size_t> direct) { known_direct_ = std::move(direct); }

  const std::vector<Note>& notes() const { return notes_; }
  bool is_constant(std::size_t literal) const { return constants_.contains(literal); }
  std::string_view TextOf(std::size_t expr) const;
  /// The routine of this file that a name calls, seen from a routine; kNone: none.
  std::size_t RoutineNamed(std::string_view name) const;

 private:
  struct Variable {
    std::vector<std::size_t> sources;  ///< right sides; kNone: not known from the file
    bool in_thread = false;
    bool in_progress = false;
    std::string overwritten;  ///< where an element is assigned
    ValuePtr value;
  };

  void CollectVariables();
  Variable* Find(std::string_view name, std::size_t routine);
  ValuePtr OfVariable(Variable& variable);
  ValuePtr OfPose(const Expr& expr, std::size_t index);
  ValuePtr OfCall(const Expr& expr);
  ValuePtr OfIndex(const Expr& expr);
  ValuePtr Compute(std::size_t index);
  ValuePtr Transformed(const ValuePtr& a, const ValuePtr& b, const Expr& call);
  ValuePtr Added(const ValuePtr& a, const ValuePtr& b, const Expr& call);
  ValuePtr WithPosture(const ValuePtr& value, const Expr& call);
  void NoteValue(const ValuePtr& value, const Expr& at, const std::string& reason);
  std::size_t Argument(const Expr& call, std::string_view name, std::size_t position) const;

  const Syntax& syntax_;
  std::string_view bytes_;
  std::unordered_map<std::string_view, std::size_t> routines_;
  std::map<std::pair<std::size_t, std::string_view>, Variable> variables_;
  std::map<const Variable*, ValuePtr> recent_;
  std::set<std::size_t> direct_, known_direct_, constants_;
  std::vector<Note> notes_;
  std::set<std::pair<const Value*, std::string>> noted_;
  std::set<std::pair<std::size_t, std::string>> reasons_;
  std::vector<ValuePtr> kept_;  ///< noted values, so that no address is used twice
  int depth_ = 0;
};

/// Rotation vector to pose.
Pose PoseOf(const double (&numbers)[6]);

}  // namespace plumbline::programs::urscript
