#include "app/programs/brands/rapid_declarations.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>

namespace plumbline::programs::rapid {

namespace {

/// Coordinates of external axes from here on mean that the axis is not used: 9E9.
constexpr double kUnusedAxis = 8.9e9;

/// [+-]number as the whole of a range.
std::optional<Number> SignedNumber(const Range& range) {
  const TokenFile& file = *range.file;
  std::size_t at = range.begin;
  const bool negative = file.IsSign(at, '-');
  if (negative || file.IsSign(at, '+')) ++at;
  if (at + 1 != range.end || file[at].kind != TokenKind::kNumber) return std::nullopt;
  const std::string_view text = file.Text(at);
  double value = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  if (read.ec != std::errc{} || read.ptr != text.data() + text.size()) return std::nullopt;
  return Number{{file.file(), file[range.begin].begin, file[at].end}, negative ? -value : value};
}

Value ValueAt(Range range, int& depth) {
  const NestingLevel level(depth);
  const TokenFile& file = *range.file;
  Value value;
  value.range = range;
  if (file.IsSign(range.begin, '[') && file.AfterBracket(range.begin) == range.end &&
      !level.too_deep()) {
    value.aggregate = true;
    for (const Range& part : SplitAtCommas({&file, range.begin + 1, range.end - 1})) {
      value.parts.push_back(ValueAt(part, depth));
    }
  } else {
    value.number = SignedNumber(range);
  }
  return value;
}

/// Whether an aggregate consists of aggregates of these sizes.
bool HasShape(const Value& value, std::initializer_list<std::size_t> sizes) {
  return value.parts.size() == sizes.size() &&
         std::equal(sizes.begin(), sizes.end(), value.parts.begin(),
                    [](std::size_t size, const Value& part) {
                      return part.aggregate && part.parts.size() == size;
                    });
}

void AddNumbers(const Value& group, Point& point) {
  for (const Value& part : group.parts) {
    if (!part.number) point.untouchable = "not all of its numbers are written out";
    point.numbers.push_back(part.number);
  }
}

/// A robtarget [[3],[4],[4],[6]] or jointtarget [[6],[6]].
std::optional<Point> PointOf(const Value& value) {
  const bool pose = HasShape(value, {3, 4, 4, 6});
  if (!pose && !HasShape(value, {6, 6})) return std::nullopt;
  Point point;
  point.place = value.range.file->PlaceOf(value.range.begin);
  point.kind = pose ? PointKind::kPose : PointKind::kJoints;
  AddNumbers(value.parts[0], point);
  if (pose) {
    AddNumbers(value.parts[1], point);
    double squares = 0;
    for (std::size_t i = 3; i < 7 && point.untouchable.empty(); ++i) {
      squares += point.numbers[i]->value * point.numbers[i]->value;
    }
    if (point.untouchable.empty() && std::abs(std::sqrt(squares) - 1) > 0.05) {
      point.untouchable = "its orientation is no rotation: the quaternion does not have length 1";
    }
    constexpr std::string_view kKeys[] = {"cf1", "cf4", "cf6", "cfx"};
    for (std::size_t i = 0; i < 4; ++i) {
      const Range& text = value.parts[2].parts[i].range;
      if (text.empty()) continue;
      const std::string_view written = text.file->Text(text.begin, text.end);
      const std::size_t begin = (*text.file)[text.begin].begin;
      point.configuration.fields.push_back({std::string(kKeys[i]),
                                            {text.file->file(), begin, begin + written.size()},
                                            std::string(written)});
    }
  }
  for (const Value& part : value.parts.back().parts) {
    const bool unused = part.number && part.number->value >= kUnusedAxis;
    if (!unused) point.external_axes.push_back(part.number);
  }
  return point;
}

bool IsWordOf(const TokenFile& file, std::size_t i, std::initializer_list<std::string_view> words) {
  return file.IsWord(i) && std::any_of(words.begin(), words.end(), [&](std::string_view word) {
           return SameWord(file.Text(i), word);
         });
}

}  // namespace

Value ValueOf(Range range) {
  int depth = 0;
  return ValueAt(range, depth);
}

std::vector<Range> SplitAtCommas(Range range) {
  std::vector<Range> parts;
  if (range.empty()) return parts;
  const TokenFile& file = *range.file;
  Range part{&file, range.begin, range.begin};
  while (part.end < range.end) {
    if (file.IsSign(part.end, ',')) {
      parts.push_back(part);
      part.begin = ++part.end;
    } else {
      part.end = std::min(file.AfterBracket(part.end), range.end);
    }
  }
  parts.push_back(part);
  return parts;
}

Designator DesignatorAt(const TokenFile& file, std::size_t at, std::size_t end) {
  Designator result;
  result.name = Lowered(file.Text(at));
  result.range = {&file, at, at + 1};
  for (std::size_t i = at + 1; i < end; result.range.end = i) {
    if (file.IsSign(i, '.') && i + 1 < end && file.IsWord(i + 1)) {
      result.accessors.push_back({Lowered(file.Text(i + 1)), {}});
      i += 2;
    } else if (file.IsSign(i, '{')) {
      const std::size_t after = std::min(file.AfterBracket(i), end);
      for (const Range& index : SplitAtCommas({&file, i + 1, after - 1})) {
        result.accessors.push_back({"", index});
      }
      i = after;
    } else {
      break;
    }
  }
  return result;
}

namespace {

/// Marks the points in a value that other modules can name.
void Show(const Value& value, Visibility to, Program& program) {
  if (value.point) program.points[*value.point].visible_to = to;
  for (const Value& part : value.parts) Show(part, to, program);
}

}  // namespace

Declarations::Declarations(const std::deque<TokenFile>& files, Program& program) {
  records_ = {
      {"robtarget",
       {{"trans", "pos"}, {"rot", "orient"}, {"robconf", "confdata"}, {"extax", "extjoint"}}},
      {"jointtarget", {{"robax", "robjoint"}, {"extax", "extjoint"}}},
      {"pose", {{"trans", "pos"}, {"rot", "orient"}}},
      {"pos", {{"x", "num"}, {"y", "num"}, {"z", "num"}}},
      {"tooldata", {{"robhold", "bool"}, {"tframe", "pose"}, {"tload", "loaddata"}}},
      {"wobjdata",
       {{"robhold", "bool"},
        {"ufprog", "bool"},
        {"ufmec", "string"},
        {"uframe", "pose"},
        {"oframe", "pose"}}},
  };
  for (const TokenFile& file : files) FindLiterals(file, program);
  for (const TokenFile& file : files) ReadFile(file);
  for (std::size_t i = 0; i < routines.size(); ++i) ReadBody(*routines[i].body.file, i);
  AttachAssignments();
  for (Data& one : data) {
    if (!one.value) continue;
    AttachPoints(*one.value);
    NamePoints(*one.value, one.type, one.dimensions, one.name, program);
    if (one.scope.routine != kNowhere || one.scope.local) continue;
    Show(*one.value,
         one.persistent && !one.scope.task ? Visibility::kController : Visibility::kTask, program);
  }
}

void Declarations::FindLiterals(const TokenFile& file, Program& program) {
  literals_.emplace_back();
  for (std::size_t i = 0; i < file.size(); ++i) {
    if (!file.IsSign(i, '[') || !file.IsSign(i + 1, '[')) continue;
    const std::size_t after = file.AfterBracket(i);
    // A target has 17 numbers. Longer aggregates are not read again for each level of nesting.
    constexpr std::size_t kMostTokens = 200;
    if (after - i > kMostTokens) continue;
    auto point = PointOf(ValueOf({&file, i, after}));
    if (!point) continue;
    literals_.back()[i] = program.points.size();
    program.points.push_back(std::move(*point));
    i = after - 1;
  }
}

std::optional<std::size_t> Declarations::PointAt(const TokenFile& file, std::size_t token) const {
  const auto& literals = literals_[file.file()];
  const auto found = literals.find(token);
  if (found == literals.end()) return std::nullopt;
  return found->second;
}

void Declarations::ReadFile(const TokenFile& file) {
  Scope scope;
  scope.module = modules_++;
  for (std::size_t i = 0; i < file.size();) {
    if (file.IsWord(i, "MODULE")) {
      scope.module = modules_++;
      ++i;
    } else if (IsWordOf(file, i, {"LOCAL", "TASK", "GLOBAL"})) {
      scope.local = file.IsWord(i, "LOCAL");
      scope.task = file.IsWord(i, "TASK");
      ++i;
      continue;
    } else if (IsWordOf(file, i, {"CONST", "PERS", "VAR"})) {
      i = ReadData(file, i, scope);
    } else if (IsWordOf(file, i, {"PROC", "FUNC", "TRAP"})) {
      i = ReadRoutine(file, i, scope);
    } else if (file.IsWord(i, "RECORD")) {
      i = ReadRecord(file, i);
    } else {
      ++i;
    }
    scope.local = scope.task = false;
  }
}

std::size_t Declarations::ReadRecord(const TokenFile& file, std::size_t at) {
  Fields fields;
  const std::string name = Lowered(file.Text(at + 1));
  for (at += 2; at < file.size() && !file.IsWord(at, "ENDRECORD"); ++at) {
    if (file.IsWord(at) && file.IsWord(at + 1) && file.IsSign(at + 2, ';')) {
      fields.emplace_back(Lowered(file.Text(at + 1)), Lowered(file.Text(at)));
      at += 2;
    }
  }
  records_.emplace(name, std::move(fields));
  return at + 1;
}

std::size_t Declarations::ReadData(const TokenFile& file, std::size_t at, Scope scope) {
  Data one;
  one.constant = file.IsWord(at, "CONST");
  one.persistent = file.IsWord(at, "PERS");
  one.type = Lowered(file.Text(at + 1));
  one.name = std::string(file.Text(at + 2));
  one.place = file.PlaceOf(at + 2);
  one.scope = scope;
  if (!file.IsWord(at + 1) || !file.IsWord(at + 2)) return at + 1;
  at += 3;
  if (file.IsSign(at, '{')) {
    const std::size_t after = file.AfterBracket(at);
    one.dimensions = static_cast<int>(SplitAtCommas({&file, at + 1, after - 1}).size());
    at = after;
  }
  if (file.IsSign(at, ":=")) {
    std::size_t end = at + 1;
    while (end < file.size() && !file.IsSign(end, ';')) end = file.AfterBracket(end);
    one.value = ValueOf({&file, at + 1, end});
    at = end;
  }
  data_by_name_[Lowered(one.name)].push_back(data.size());
  data.push_back(std::move(one));
  return at;
}

std::size_t Declarations::ReadRoutine(const TokenFile& file, std::size_t at, Scope scope) {
  RoutineText routine;
  routine.scope = scope;
  const bool function = file.IsWord(at, "FUNC");
  routine.trap = file.IsWord(at, "TRAP");
  const std::string_view end_word = function ? "ENDFUNC" : routine.trap ? "ENDTRAP" : "ENDPROC";
  if (function) routine.type = Lowered(file.Text(++at));
  ++at;
  if (!file.IsWord(at)) return at;
  routine.name = std::string(file.Text(at));
  routine.place = file.PlaceOf(at);
  ++at;
  if (file.IsSign(at, '(')) {
    const std::size_t after = file.AfterBracket(at);
    for (Range part : SplitAtCommas({&file, at + 1, after - 1})) {
      // `\switch On | switch Off`: each alternative is a parameter of its own.
      bool optional = false;
      std::vector<std::string> words;
      int dimensions = 0;
      const auto add = [&] {
        if (words.size() >= 2) {
          Parameter parameter;
          parameter.by_reference = words.size() > 2;
          parameter.type = words[words.size() - 2];
          parameter.name = words.back();
          parameter.optional = optional;
          parameter.dimensions = dimensions;
          routine.parameters.push_back(std::move(parameter));
        }
        words.clear();
        dimensions = 0;
      };
      for (std::size_t i = part.begin; i < part.end; ++i) {
        if (file.IsSign(i, '\\')) {
          add();  // an optional parameter needs no comma before it
          optional = true;
        } else if (file.IsSign(i, '|')) {
          add();
        } else if (file.IsSign(i, '{')) {
          const std::size_t after_index = file.AfterBracket(i);
          dimensions = static_cast<int>(SplitAtCommas({&file, i + 1, after_index - 1}).size());
          i = after_index - 1;
        } else if (file.IsWord(i)) {
          words.push_back(Lowered(file.Text(i)));
        }
      }
      add();
    }
    at = after;
  }
  routine.body = {&file, at, at};
  while (at < file.size() && !file.IsWord(at, end_word) &&
         !IsWordOf(file, at, {"PROC", "FUNC", "TRAP", "ENDMODULE"})) {
    ++at;
  }
  routine.body.end = at;
  routines_by_name_[Lowered(routine.name)].push_back(routines.size());
  routines.push_back(std::move(routine));
  return file.IsWord(at, end_word) ? at + 1 : at;
}

void Declarations::ReadBody(const TokenFile& file, std::size_t index) {
  RoutineText& routine = routines[index];
  Scope scope = routine.scope;
  scope.routine = index;
  std::size_t designator = 0;  // the last word at which a statement may start
  for (std::size_t i = routine.body.begin; i < routine.body.end; ++i) {
    if (IsWordOf(file, i, {"CONST", "PERS", "VAR"})) {
      i = ReadData(file, i, scope);
    } else if (file.IsWord(i, "ERROR")) {
      routine.handles_errors = true;
    } else if (file.IsWord(i, "BACKWARD")) {
      routine.handles_backward = true;
    } else if (file.IsWord(i, "UNDO")) {
      routine.handles_undo = true;
    } else if (file.IsWord(i, "RETURN")) {
      Range value{&file, i + 1, i + 1};
      while (value.end < routine.body.end && !file.IsSign(value.end, ';')) ++value.end;
      if (!value.empty()) routine.returns.push_back(value);
    } else if (file.IsSign(i, '[') || file.IsSign(i, '(') || file.IsSign(i, '{')) {
      i = file.AfterBracket(i) - 1;
    } else if (file.IsWord(i) && !file.IsSign(i - 1, '.')) {
      designator = i;
    } else if (file.IsSign(i, ":=") && designator > 0 && !file.IsSign(designator - 1, '\\')) {
      Assignment one;
      one.target = DesignatorAt(file, designator, i);
      if (one.target.range.end != i) continue;
      one.value = {&file, i + 1, i + 1};
      while (one.value.end < routine.body.end && !file.IsSign(one.value.end, ';')) ++one.value.end;
      one.routine = index;
      assignments_.push_back(std::move(one));
    }
  }
}

void Declarations::AttachAssignments() {
  for (Assignment& one : assignments_) {
    RoutineText& routine = routines[one.routine];
    const auto parameter =
        std::find_if(routine.parameters.begin(), routine.parameters.end(),
                     [&](const Parameter& p) { return p.name == one.target.name; });
    if (parameter != routine.parameters.end()) {
      parameter->assigned = true;
      continue;
    }
    Scope from = routine.scope;
    from.routine = one.routine;
    const auto found = FindData(one.target.name, from);
    if (found) data[*found].assigned.push_back(std::move(one));
  }
  assignments_.clear();
}

void Declarations::AttachPoints(Value& value) {
  if (!value.aggregate) return;
  value.point = PointAt(*value.range.file, value.range.begin);
  if (!value.point) {
    for (Value& part : value.parts) AttachPoints(part);
  }
}

void Declarations::NamePoints(const Value& value, const std::string& type, int dimensions,
                              const std::string& path, Program& program) const {
  if (value.point) {
    Point& point = program.points[*value.point];
    point.name = path;
    if (dimensions > 0 || type != (point.kind == PointKind::kPose ? "robtarget" : "jointtarget")) {
      point.untouchable =
          fmt::format("in data of type {}, whose declaration is not in these files", type);
    }
    return;
  }
  const Fields* const fields = dimensions > 0 ? nullptr : FieldsOf(type);
  for (std::size_t i = 0; i < value.parts.size(); ++i) {
    if (dimensions > 0) {
      NamePoints(value.parts[i], type, dimensions - 1, fmt::format("{}{{{}}}", path, i + 1),
                 program);
    } else if (fields != nullptr && i < fields->size()) {
      NamePoints(value.parts[i], (*fields)[i].second, 0, path + "." + (*fields)[i].first, program);
    } else {
      NamePoints(value.parts[i], type, 0, path, program);
    }
  }
}

const std::vector<std::pair<std::string, std::string>>* Declarations::FieldsOf(
    const std::string& type) const {
  const auto found = records_.find(type);
  return found == records_.end() ? nullptr : &found->second;
}

bool Declarations::HoldsPoints(const std::string& type) const {
  if (type == "robtarget" || type == "jointtarget") return true;
  const auto known = holds_points_.find(type);
  if (known != holds_points_.end()) return known->second;
  holds_points_[type] = false;  // a record that contains itself
  const Fields* const fields = FieldsOf(type);
  const bool holds = fields != nullptr &&
                     std::any_of(fields->begin(), fields->end(),
                                 [&](const auto& field) { return HoldsPoints(field.second); });
  return holds_points_[type] = holds;
}

namespace {

/// The candidate that RAPID sees from `from`: its routine's, its module's, the only global one.
template <typename ScopeOf>
std::optional<std::size_t> Visible(const std::vector<std::size_t>& candidates, const Scope& from,
                                   const ScopeOf& scope_of) {
  std::optional<std::size_t> in_module, global;
  bool ambiguous = false;
  for (const std::size_t i : candidates) {
    const Scope& scope = scope_of(i);
    if (scope.routine != kNowhere) {
      if (scope.routine == from.routine) return i;
    } else if (scope.module == from.module) {
      if (!in_module) in_module = i;
    } else if (!scope.local) {
      ambiguous = global.has_value();
      global = i;
    }
  }
  if (in_module) return in_module;
  return ambiguous ? std::nullopt : global;
}

}  // namespace

std::optional<std::size_t> Declarations::FindData(const std::string& name,
                                                  const Scope& from) const {
  const auto found = data_by_name_.find(name);
  if (found == data_by_name_.end()) return std::nullopt;
  return Visible(found->second, from, [&](std::size_t i) -> const Scope& { return data[i].scope; });
}

std::optional<std::size_t> Declarations::FindRoutine(const std::string& name,
                                                     const Scope& from) const {
  const auto found = routines_by_name_.find(name);
  if (found == routines_by_name_.end()) return std::nullopt;
  return Visible(found->second, from,
                 [&](std::size_t i) -> const Scope& { return routines[i].scope; });
}

}  // namespace plumbline::programs::rapid
