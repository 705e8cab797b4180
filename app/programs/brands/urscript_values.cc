#include "app/programs/brands/urscript_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "app/programs/brands/urscript_functions.h"
#include "firmware-like/geometry/rotation.h"

namespace plumbline::programs::urscript {

namespace {

constexpr int kMostSteps = 200;  ///< from variable to variable
constexpr char kTooMany[] = "is one of too many values";

using Kind = Value::Kind;

ValuePtr Unknown() {
  static const ValuePtr kUnknown = std::make_shared<Value>();
  return kUnknown;
}

ValuePtr NumberValue(double number) {
  Value value;
  value.kind = Kind::kNumber;
  value.number = number;
  return std::make_shared<Value>(std::move(value));
}

ValuePtr FrameOf(const Pose& X) {
  Value value;
  value.kind = Kind::kFrame;
  value.X = X;
  return std::make_shared<Value>(std::move(value));
}

/// One of several values, without alternatives inside alternatives.
ValuePtr OneOf(const std::vector<ValuePtr>& values) {
  if (values.size() == 1) return values.front();
  Value any;
  any.kind = Kind::kOneOf;
  for (const ValuePtr& value : values) {
    if (value->kind == Kind::kOneOf) {
      any.items.insert(any.items.end(), value->items.begin(), value->items.end());
    } else {
      any.items.push_back(value);
    }
    if (any.items.size() > kMostAlternatives) return Unknown();
  }
  if (any.items.empty()) return Unknown();
  return std::make_shared<Value>(std::move(any));
}

bool IsPose(const Value& value) {
  return value.kind == Kind::kFrame || value.kind == Kind::kDestination;
}

/// A destination that is a written pose and nothing else.
bool IsBare(const Value& value) {
  return value.kind == Kind::kDestination && value.destination.base.empty() &&
         value.destination.offset.in == Offset::In::kNone;
}

bool Turns(const Pose& X) {
  return !X.R.isIdentity(1e-12);
}

}  // namespace

Pose PoseOf(const double (&numbers)[6]) {
  return {RotationFromVector({numbers[3], numbers[4], numbers[5]}),
          {numbers[0], numbers[1], numbers[2]}};
}

Values::Values(const Syntax& syntax, std::string_view bytes) : syntax_(syntax), bytes_(bytes) {
  for (std::size_t i = 1; i < syntax.routines.size(); ++i) {
    routines_.try_emplace(syntax.routines[i].name, i);
  }
  CollectVariables();
}

std::string_view Values::TextOf(std::size_t expr) const {
  const Expr& of = syntax_.exprs[expr];
  return bytes_.substr(of.begin, of.end - of.begin);
}

std::size_t Values::RoutineNamed(std::string_view name) const {
  const auto found = routines_.find(name);
  return found == routines_.end() ? kNone : found->second;
}

std::size_t Values::Argument(const Expr& call, std::string_view name, std::size_t position) const {
  for (std::size_t i = 0; i < call.parts.size(); ++i) {
    if (call.part_names[i] == name) return call.parts[i];
  }
  if (position < call.parts.size() && call.part_names[position].empty()) {
    return call.parts[position];
  }
  return kNone;
}

void Values::CollectVariables() {
  // Parameters and `local` names belong to their routine, all others to the file: a name that is
  // assigned without a declaration is the variable of an outer routine if there is one.
  for (std::size_t i = 0; i < syntax_.routines.size(); ++i) {
    for (const Parameter& parameter : syntax_.routines[i].parameters) {
      Variable& variable = variables_[{i, parameter.name}];
      if (parameter.standard != kNone) variable.sources.push_back(parameter.standard);
    }
  }
  for (const Statement& statement : syntax_.statements) {
    if (statement.local && !statement.name.empty()) {
      variables_[{statement.routine, statement.name}];
    }
  }
  for (const Statement& statement : syntax_.statements) {
    const bool element = statement.kind == StatementKind::kElementAssign;
    const bool starts = statement.kind == StatementKind::kRun && !statement.name.empty();
    if (statement.kind != StatementKind::kAssign && !element && !starts) continue;
    Variable* variable = statement.global ? nullptr : Find(statement.name, statement.routine);
    if (variable == nullptr) variable = &variables_[{0, statement.name}];
    variable->in_thread |= syntax_.routines[statement.routine].thread;
    if (element) {
      variable->overwritten = fmt::format("is overwritten in line {}", statement.line);
    } else {
      variable->sources.push_back(starts ? kNone : statement.expr);
    }
  }
  for (const Expr& call : syntax_.exprs) {
    if (call.kind != ExprKind::kCall) continue;
    const std::size_t routine = RoutineNamed(call.name);
    if (routine == kNone) continue;
    const std::vector<Parameter>& parameters = syntax_.routines[routine].parameters;
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      const std::size_t argument = Argument(call, parameters[i].name, i);
      if (argument != kNone) {
        variables_[{routine, parameters[i].name}].sources.push_back(argument);
      }
    }
  }
}

Values::Variable* Values::Find(std::string_view name, std::size_t routine) {
  for (int level = 0; level < kMostSteps; ++level) {
    const auto found = variables_.find({routine, name});
    if (found != variables_.end()) return &found->second;
    if (routine == 0) return nullptr;
    routine = syntax_.routines[routine].outer;
  }
  return nullptr;
}

ValuePtr Values::OfVariable(Variable& variable) {
  if (!variable.in_thread) {
    const auto recent = recent_.find(&variable);
    if (recent != recent_.end()) return recent->second;
  }
  if (variable.value != nullptr) return variable.value;
  if (variable.in_progress) return Unknown();
  variable.in_progress = true;
  std::vector<ValuePtr> values;
  bool counts = variable.sources.empty() || variable.sources.size() > kMostAlternatives;
  for (const std::size_t source : variable.sources) {
    const ValuePtr value = source == kNone ? Unknown() : Of(source);
    if (value->kind == Kind::kNumber) counts = variable.sources.size() > 1;
    values.push_back(value);
  }
  // A number that changes is not followed: its values are not only those that are written.
  if (counts) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (variable.sources[i] != kNone) {
        NoteValue(values[i], syntax_.exprs[variable.sources[i]], kTooMany);
      }
    }
  }
  variable.value = counts ? Unknown() : OneOf(values);
  variable.in_progress = false;
  // Once an element is assigned, the variable is none of the values that are written.
  if (!variable.overwritten.empty()) {
    if (!variable.sources.empty() && variable.sources.front() != kNone) {
      NoteValue(variable.value, syntax_.exprs[variable.sources.front()], variable.overwritten);
    }
    variable.value = Unknown();
  }
  return variable.value;
}

void Values::Remember(const Statement& assignment) {
  Variable* variable = Find(assignment.name, assignment.global ? 0 : assignment.routine);
  if (variable == nullptr) return;
  if (assignment.kind != StatementKind::kAssign) {
    recent_.erase(variable);
  } else if (variable->sources.size() > 1 && assignment.expr != kNone &&
             variable->overwritten.empty()) {
    recent_[variable] = Of(assignment.expr);
  }
}

ValuePtr Values::Of(std::size_t expr) {
  if (expr == kNone || depth_ > kMostSteps) return Unknown();
  ++depth_;
  ValuePtr value = Compute(expr);
  --depth_;
  return value;
}

ValuePtr Values::Compute(std::size_t index) {
  const Expr& expr = syntax_.exprs[index];
  switch (expr.kind) {
    case ExprKind::kNumber:
      return NumberValue(expr.number);
    case ExprKind::kName: {
      Variable* variable = Find(expr.name, expr.routine);
      return variable == nullptr ? Unknown() : OfVariable(*variable);
    }
    case ExprKind::kPose:
      return OfPose(expr, index);
    case ExprKind::kCall:
      return OfCall(expr);
    case ExprKind::kIndex:
      return OfIndex(expr);
    case ExprKind::kList: {
      Value list;
      list.kind = Kind::kList;
      list.expr = index;
      for (const std::size_t part : expr.parts) list.items.push_back(Of(part));
      return std::make_shared<Value>(std::move(list));
    }
    case ExprKind::kSign: {
      const ValuePtr value = Of(expr.parts[0]);
      if (value->kind == Kind::kNumber) {
        return NumberValue(expr.sign == '-' ? -value->number : value->number);
      }
      NoteValue(value, expr, "goes into a calculation");
      return Unknown();
    }
    case ExprKind::kBinary: {
      std::vector<ValuePtr> values;
      for (const std::size_t part : expr.parts) values.push_back(Of(part));
      if (values.size() == 2 && values[0]->kind == Kind::kNumber &&
          values[1]->kind == Kind::kNumber) {
        const double a = values[0]->number, b = values[1]->number;
        if (expr.sign == '+') return NumberValue(a + b);
        if (expr.sign == '-') return NumberValue(a - b);
        if (expr.sign == '*') return NumberValue(a * b);
        if (expr.sign == '/' && b != 0) return NumberValue(a / b);
      }
      for (const ValuePtr& value : values) NoteValue(value, expr, "goes into a calculation");
      return Unknown();
    }
    case ExprKind::kOther:
      for (const std::size_t part : expr.parts) {
        NoteValue(Of(part), expr, "stands in a statement that is not understood");
      }
      return Unknown();
    case ExprKind::kWord:
      return Unknown();
  }
  return Unknown();
}

ValuePtr Values::OfPose(const Expr& expr, std::size_t index) {
  if (expr.parts.size() != 6) {
    for (const std::size_t part : expr.parts) Of(part);
    return Unknown();
  }
  double numbers[6];
  bool written = true;
  for (std::size_t i = 0; i < 6; ++i) {
    const std::optional<double> number = ConstantNumber(expr.parts[i]);
    if (!number) {
      for (const std::size_t part : expr.parts) Of(part);
      return Unknown();
    }
    numbers[i] = *number;
    written &= syntax_.exprs[expr.parts[i]].kind == ExprKind::kNumber;
  }
  if (!written) return FrameOf(PoseOf(numbers));
  Value value;
  value.kind = Kind::kDestination;
  value.X = PoseOf(numbers);
  value.destination.literal = index;
  return std::make_shared<Value>(std::move(value));
}

ValuePtr Values::OfIndex(const Expr& expr) {
  const ValuePtr of = Of(expr.parts[0]);
  const std::optional<double> at = ConstantNumber(expr.parts[1]);
  if (of->kind == Kind::kList && expr.parts.size() == 2) {
    if (!at) {
      const ValuePtr any = OneOf(of->items);
      if (any->kind == Kind::kUnknown) NoteValue(of, expr, kTooMany);
      return any;
    }
    if (*at >= 0 && *at < static_cast<double>(of->items.size())) {
      return of->items[static_cast<std::size_t>(*at)];
    }
    return Unknown();
  }
  if (of->kind == Kind::kOneOf) {
    std::vector<ValuePtr> items;
    for (const ValuePtr& list : of->items) {
      if (list->kind != Kind::kList) continue;
      for (std::size_t i = 0; i < list->items.size(); ++i) {
        if (!at || static_cast<double>(i) == *at) items.push_back(list->items[i]);
      }
      if (items.size() > kMostAlternatives) break;
    }
    const ValuePtr any = OneOf(items);
    if (any->kind != Kind::kUnknown) return any;
    NoteValue(of, expr, kTooMany);
    return any;
  }
  NoteValue(of, expr, "is used number by number");
  return Unknown();
}

ValuePtr Values::OfCall(const Expr& call) {
  const std::string_view name = call.name;
  const auto number = [&](double factor) {
    const std::optional<double> value = ConstantNumber(Argument(call, "", 0));
    return value ? NumberValue(*value * factor) : Unknown();
  };
  if (name == "d2r") return number(std::numbers::pi / 180);
  if (name == "r2d") return number(180 / std::numbers::pi);
  const bool adds = name == "pose_add";
  if ((adds || name == "pose_trans") && call.parts.size() == 2) {
    const ValuePtr a = Of(call.parts[0]), b = Of(call.parts[1]);
    std::vector<ValuePtr> made;
    const std::vector<ValuePtr> as = a->kind == Kind::kOneOf ? a->items : std::vector{a};
    const std::vector<ValuePtr> bs = b->kind == Kind::kOneOf ? b->items : std::vector{b};
    if (as.size() * bs.size() <= kMostAlternatives) {
      for (const ValuePtr& one : as) {
        for (const ValuePtr& other : bs) {
          made.push_back(adds ? Added(one, other, call) : Transformed(one, other, call));
        }
      }
      return OneOf(made);
    }
  }
  if (name == "get_inverse_kin") {
    const std::size_t pose = Argument(call, "x", 0);
    const ValuePtr value = Of(pose);
    if (value->kind != Kind::kOneOf) return WithPosture(value, call);
    std::vector<ValuePtr> made;
    for (const ValuePtr& item : value->items) made.push_back(WithPosture(item, call));
    return OneOf(made);
  }
  if (name == "pose_inv" && call.parts.size() == 1) {
    const ValuePtr value = Of(call.parts[0]);
    NoteValue(value, call, "is used inverted (pose_inv)");
    return IsPose(*value) ? FrameOf(value->X.Inverse()) : Unknown();
  }
  // What a routine of the file does with its arguments is seen in the routine, and where a motion
  // goes, where the motion is read. Texts, and whether a point can be reached, change no motion.
  const FunctionKind kind = KindOf(name);
  const bool harmless = RoutineNamed(name) != kNone || kind == FunctionKind::kMotion ||
                        kind == FunctionKind::kSetting || name == "textmsg" || name == "popup" ||
                        name == "to_str" || name == "length" || name == "get_list_length" ||
                        name == "get_inverse_kin_has_solution" || name == "is_within_safety_limits";
  for (const std::size_t part : call.parts) {
    const ValuePtr value = Of(part);
    if (harmless) continue;
    const std::string reason = name == "pose_sub"
                                   ? "counts only by its difference from another pose (pose_sub)"
                                   : fmt::format("goes into {}()", name);
    // A pose that is written into a function of the language is no place to go to; a structure
    // keeps it for later.
    if (kind == FunctionKind::kOther || kind == FunctionKind::kMoves || name == "struct") {
      NoteValue(value, call, reason);
    } else {
      NoteConstant(part, reason);
    }
  }
  return Unknown();
}

ValuePtr Values::WithPosture(const ValuePtr& value, const Expr& call) {
  if (value->kind != Kind::kDestination) return Unknown();
  Value made = *value;
  if (const auto near_q = ConstantNumbers(Argument(call, "qnear", 1))) {
    made.destination.near_q = *near_q;
  }
  if (const std::size_t tool = Argument(call, "tcp", 4); tool != kNone) {
    made.destination.tool = ConstantPose(tool);
    NoteConstant(tool, "is the tool of get_inverse_kin");
  }
  return std::make_shared<Value>(std::move(made));
}

ValuePtr Values::Transformed(const ValuePtr& a, const ValuePtr& b, const Expr& call) {
  const auto unknown = [&] {
    NoteValue(a, call, "is moved by a computed pose (pose_trans)");
    NoteValue(b, call, "is moved by a computed pose (pose_trans)");
    return Unknown();
  };
  if (!IsPose(*a) || !IsPose(*b)) return unknown();
  Value made;
  made.X = a->X * b->X;
  made.kind = Kind::kDestination;
  const bool a_goes = a->kind == Kind::kDestination &&
                      (!IsBare(*a) || known_direct_.contains(a->destination.literal));
  const bool b_goes = IsBare(*b) && known_direct_.contains(b->destination.literal);
  const auto constant = [&](const ValuePtr& of, std::size_t part, const char* reason) {
    if (of->kind != Kind::kDestination) return;
    if (of->destination.literal == call.parts[part]) {
      constants_.insert(call.parts[part]);
    } else {
      NoteValue(of, call, reason);
    }
  };
  if (a->kind == Kind::kFrame && b->kind == Kind::kFrame) {
    made.kind = Kind::kFrame;
  } else if (a_goes || b->kind == Kind::kFrame) {
    // A point, moved in its own frame.
    made.destination = a->destination;
    Offset& offset = made.destination.offset;
    if (offset.in == Offset::In::kBase) return unknown();
    offset.X = offset.in == Offset::In::kNone ? b->X : offset.X * b->X;
    offset.in = Offset::In::kTool;
    constant(b, 1, "is an offset from a point (pose_trans)");
  } else if (b_goes) {
    // A point to which motions also go directly, moved in the base.
    made.destination = b->destination;
    made.destination.offset = {Offset::In::kBase, a->X, ""};
    constant(a, 0, "moves a point in the base (pose_trans)");
  } else if (b->destination.base.empty() && b->destination.offset.in != Offset::In::kBase) {
    // A point in a feature.
    made.destination = b->destination;
    made.destination.base = std::string(TextOf(call.parts[0]).substr(0, 120));
    made.destination.X_base = a->X;
    constant(a, 0, "is the frame of other points (pose_trans)");
  } else {
    return unknown();
  }
  return std::make_shared<Value>(std::move(made));
}

/// Sum of the positions, product of the rotations.
ValuePtr Values::Added(const ValuePtr& a, const ValuePtr& b, const Expr& call) {
  const bool poses = IsPose(*a) && IsPose(*b);
  if (poses && a->kind == Kind::kFrame && b->kind == Kind::kFrame) {
    return FrameOf({a->X.R * b->X.R, a->X.p + b->X.p});
  }
  const bool second = poses && b->kind == Kind::kDestination &&
                      (a->kind == Kind::kFrame || (Turns(b->X) && !Turns(a->X)));
  const ValuePtr& point = second ? b : a;
  const ValuePtr& shift = second ? a : b;
  if (!poses || Turns(shift->X) || !IsBare(*point)) {
    NoteValue(a, call, "is added to a computed pose (pose_add)");
    NoteValue(b, call, "is added to a computed pose (pose_add)");
    return Unknown();
  }
  Value made = *point;
  made.X.p += shift->X.p;
  made.destination.offset = {Offset::In::kBase, {Mat3::Identity(), shift->X.p}, ""};
  const std::size_t written = call.parts[second ? 0 : 1];
  if (shift->kind == Kind::kDestination && shift->destination.literal == written) {
    constants_.insert(written);
  } else {
    NoteValue(shift, call, "is added to a point (pose_add)");
  }
  return std::make_shared<Value>(std::move(made));
}

std::vector<std::optional<Destination>> Values::Destinations(std::size_t expr) {
  const ValuePtr value = Of(expr);
  std::vector<std::optional<Destination>> found;
  const auto add = [&](const Value& one) {
    if (one.kind == Kind::kDestination) {
      if (one.destination.base.empty() && one.destination.offset.in == Offset::In::kNone) {
        direct_.insert(one.destination.literal);
      }
      found.emplace_back(one.destination);
    } else if (one.kind == Kind::kList && one.items.size() == 6 &&
               std::all_of(syntax_.exprs[one.expr].parts.begin(),
                           syntax_.exprs[one.expr].parts.end(), [&](std::size_t part) {
                             return syntax_.exprs[part].kind == ExprKind::kNumber;
                           })) {
      Destination joints;
      joints.literal = one.expr;
      found.emplace_back(std::move(joints));
    } else {
      found.emplace_back();
    }
  };
  if (value->kind == Kind::kOneOf) {
    for (const ValuePtr& item : value->items) add(*item);
  } else {
    add(*value);
  }
  return found;
}

std::optional<Pose> Values::ConstantPose(std::size_t expr) {
  const ValuePtr value = Of(expr);
  if (!IsPose(*value)) return std::nullopt;
  return value->X;
}

std::optional<double> Values::ConstantNumber(std::size_t expr) {
  if (expr == kNone) return std::nullopt;
  const Expr& of = syntax_.exprs[expr];
  if (of.kind == ExprKind::kNumber) return of.number;
  const ValuePtr value = Of(expr);
  if (value->kind != Kind::kNumber) return std::nullopt;
  return value->number;
}

namespace {

std::optional<std::vector<double>> NumbersIn(const ValuePtr& value) {
  if (value->kind != Kind::kList || value->items.empty()) return std::nullopt;
  std::vector<double> numbers;
  for (const ValuePtr& item : value->items) {
    if (item->kind != Kind::kNumber) return std::nullopt;
    numbers.push_back(item->number);
  }
  return numbers;
}

}  // namespace

std::optional<std::vector<double>> Values::ConstantNumbers(std::size_t expr) {
  return NumbersIn(Of(expr));
}

std::optional<std::vector<double>> Values::ConstantVariable(std::string_view name) {
  Variable* const variable = Find(name, 0);
  if (variable == nullptr) return std::nullopt;
  return NumbersIn(OfVariable(*variable));
}

void Values::NoteUse(std::size_t expr, const std::string& reason) {
  if (expr != kNone) NoteValue(Of(expr), syntax_.exprs[expr], reason);
}

void Values::NoteConstant(std::size_t expr, const std::string& reason) {
  if (expr == kNone) return;
  if (syntax_.exprs[expr].kind == ExprKind::kPose) {
    constants_.insert(expr);
  } else {
    NoteUse(expr, reason);
  }
}

void Values::NoteValue(const ValuePtr& value, const Expr& at, const std::string& reason) {
  if (value->kind == Kind::kDestination) {
    if (!reasons_.insert({value->destination.literal, reason}).second) return;
    notes_.push_back({value->destination.literal, at.routine, at.line, reason});
  } else if (value->kind == Kind::kList || value->kind == Kind::kOneOf) {
    if (!noted_.insert({value.get(), reason}).second) return;
    kept_.push_back(value);
    for (const ValuePtr& item : value->items) {
      if (item->kind != Kind::kNumber) NoteValue(item, at, reason);
    }
  }
}

}  // namespace plumbline::programs::urscript
