#include "app/programs/brands/rapid_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "app/programs/brands/rapid_frames.h"

namespace plumbline::programs::rapid {

namespace {

constexpr std::string_view kPoseFunctions[] = {"offs",     "reltool", "crobt",
                                               "calcrobt", "orobt",   "mirpos"};
constexpr std::string_view kJointFunctions[] = {"cjointt", "calcjointt"};

template <typename List>
bool Contains(const List& list, std::string_view name) {
  return std::find(std::begin(list), std::end(list), name) != std::end(list);
}

}  // namespace

std::vector<Argument> ArgumentsOf(Range range) {
  std::vector<Argument> arguments;
  const TokenFile& file = *range.file;
  for (const Range& part : SplitAtCommas(range)) {
    std::size_t at = part.begin;
    const auto end_of = [&](std::size_t from) {
      while (from < part.end && !file.IsSign(from, '\\')) {
        from = std::min(file.AfterBracket(from), part.end);
      }
      return from;
    };
    if (!file.IsSign(at, '\\') && at < part.end) {
      arguments.push_back({"", {&file, at, end_of(at)}, false});
      at = end_of(at);
    }
    while (at < part.end) {  // at a backslash
      Argument one;
      one.name = Lowered(file.Text(at + 1));
      const std::size_t sign = at + 2;
      const std::size_t end = end_of(at + 1);
      one.conditional = file.IsSign(sign, '?');
      if (one.conditional || file.IsSign(sign, ":=")) one.value = {&file, sign + 1, end};
      if (file.IsWord(at + 1)) arguments.push_back(one);
      at = end;
    }
  }
  return arguments;
}

Values::Values(const Declarations& declarations, Program& program)
    : declarations_(declarations), program_(program) {
  program_.tools["tool0"] = {};
  program_.bases["wobj0"] = {};
  program_.tools["tool0"].load = LoadValue{0.001, Vec3(0, 0, 1e-6)};
}

std::string Values::At(const Place& place) const {
  return fmt::format("{}:{}", program_.files[place.file].name, place.line);
}

const Parameter* Values::ParameterOf(const std::string& name, const Context& context) const {
  if (context.scope.routine == kNowhere) return nullptr;
  for (const Parameter& one : declarations_.routines[context.scope.routine].parameters) {
    if (one.name == name) return &one;
  }
  return nullptr;
}

std::optional<double> Values::ConstantOf(Range range, const Context& context) {
  if (range.empty()) return std::nullopt;
  const NestingLevel level(depth_);
  if (level.too_deep()) return std::nullopt;
  const auto value = Sum(range, context, 0);
  return range.empty() && value && std::isfinite(*value) ? value : std::nullopt;
}

std::optional<double> Values::Sum(Range& rest, const Context& context, int depth) {
  auto value = Product(rest, context, depth);
  while (value && !rest.empty()) {
    const bool plus = rest.file->IsSign(rest.begin, '+');
    if (!plus && !rest.file->IsSign(rest.begin, '-')) break;
    ++rest.begin;
    const auto next = Product(rest, context, depth);
    if (!next) return std::nullopt;
    value = plus ? *value + *next : *value - *next;
  }
  return value;
}

std::optional<double> Values::Product(Range& rest, const Context& context, int depth) {
  auto value = Factor(rest, context, depth);
  while (value && !rest.empty()) {
    const bool times = rest.file->IsSign(rest.begin, '*');
    if (!times && !rest.file->IsSign(rest.begin, '/')) break;
    ++rest.begin;
    const auto next = Factor(rest, context, depth);
    if (!next || (!times && *next == 0)) return std::nullopt;
    value = times ? *value * *next : *value / *next;
  }
  return value;
}

std::optional<double> Values::Factor(Range& rest, const Context& context, int depth) {
  bool negative = false;
  while (!rest.empty() &&
         (rest.file->IsSign(rest.begin, '-') || rest.file->IsSign(rest.begin, '+'))) {
    negative ^= rest.file->IsSign(rest.begin, '-');
    ++rest.begin;
  }
  if (rest.empty() || depth > kMaxNesting) return std::nullopt;
  const TokenFile& file = *rest.file;
  const std::size_t at = rest.begin;
  std::optional<double> value;
  if (file.IsSign(at, '(')) {
    Range inner{&file, at + 1, std::min(file.AfterBracket(at), rest.end) - 1};
    rest.begin = inner.end + 1;
    value = Sum(inner, context, depth + 1);
    if (!inner.empty()) return std::nullopt;
  } else if (file[at].kind == TokenKind::kNumber) {
    ++rest.begin;
    const auto number = ValueOf({&file, at, at + 1}).number;
    if (number) value = number->value;
  } else if (file.IsWord(at)) {
    const Designator name = DesignatorAt(file, at, rest.end);
    rest.begin = name.range.end;
    if (ParameterOf(name.name, context) != nullptr) {
      if (context.instance != nullptr && name.accessors.empty()) {
        const auto bound = context.instance->bound.find(name.name);
        if (bound != context.instance->bound.end()) value = bound->second.number;
      }
    } else if (const auto found = declarations_.FindData(name.name, context.scope)) {
      const Data& data = declarations_.data[*found];
      if (!data.constant || !data.value || !name.accessors.empty()) return std::nullopt;
      const auto known = constants_.emplace(*found, std::nullopt);  // none while it is computed
      if (known.second) {
        const auto computed = ConstantOf(data.value->range, {data.scope, nullptr});
        constants_[*found] = computed;
      }
      value = constants_[*found];
    }
  }
  if (value && negative) value = -*value;
  return value;
}

Part::Step Values::StepOf(const Accessor& accessor, const Context& context) {
  if (!accessor.field.empty()) return {accessor.field, std::nullopt};
  const auto index = ConstantOf(accessor.index, context);
  if (!index || *index < 1 || *index > 1e6) return {"", std::nullopt};
  return {"", static_cast<int>(std::lround(*index))};
}

std::optional<Part> Values::PartOf(const Designator& designator, const Context& context) {
  Part part;
  if (ParameterOf(designator.name, context) != nullptr) {
    if (context.instance == nullptr) return std::nullopt;
    const auto bound = context.instance->bound.find(designator.name);
    if (bound == context.instance->bound.end() || !bound->second.part) return std::nullopt;
    part = *bound->second.part;
  } else {
    const auto found = declarations_.FindData(designator.name, context.scope);
    if (!found) return std::nullopt;
    part.data = *found;
  }
  for (const Accessor& one : designator.accessors) part.steps.push_back(StepOf(one, context));
  return part;
}

namespace {

/// The position of a field in its record; nullopt if the record or the field is not known.
std::optional<std::size_t> FieldOf(const Declarations& declarations, std::string& type,
                                   const std::string& field) {
  const auto* const fields = declarations.FieldsOf(type);
  if (fields == nullptr) return std::nullopt;
  for (std::size_t i = 0; i < fields->size(); ++i) {
    if ((*fields)[i].first != field) continue;
    type = (*fields)[i].second;
    return i;
  }
  return std::nullopt;
}

}  // namespace

std::pair<std::string, int> Values::TypeOf(const Part& part) const {
  const Data& data = declarations_.data[part.data];
  std::string type = data.type;
  int dimensions = data.dimensions;
  for (const Part::Step& step : part.steps) {
    if (dimensions == 0 && IsPointType(type)) break;
    if (step.field.empty()) {
      --dimensions;
    } else if (!FieldOf(declarations_, type, step.field)) {
      return {"", 0};
    }
  }
  return {type, std::max(dimensions, 0)};
}

bool Values::IsTarget(const Part& part) const {
  const auto is = [&](const Part& one) {
    const auto [type, dimensions] = TypeOf(one);
    return dimensions == 0 && IsPointType(type);
  };
  if (!is(part) || part.steps.empty()) return is(part);
  Part outer = part;
  outer.steps.pop_back();
  return !is(outer);
}

std::vector<const Value*> Values::ValuesOf(const Part& part) const {
  const Data& data = declarations_.data[part.data];
  if (!data.value) return {};
  std::vector<const Value*> values{&*data.value};
  std::string type = data.type;
  int dimensions = data.dimensions;
  for (const Part::Step& step : part.steps) {
    if (dimensions == 0 && IsPointType(type)) break;
    std::optional<std::size_t> chosen;
    if (step.field.empty()) {
      --dimensions;
      if (step.index) chosen = static_cast<std::size_t>(*step.index) - 1;
    } else if (chosen = FieldOf(declarations_, type, step.field); !chosen) {
      return {};
    }
    std::vector<const Value*> next;
    for (const Value* const value : values) {
      if (chosen) {
        if (*chosen < value->parts.size()) next.push_back(&value->parts[*chosen]);
      } else {
        for (const Value& one : value->parts) next.push_back(&one);
      }
    }
    values = std::move(next);
  }
  return values;
}

bool Values::MayBe(const Part& part, const Assignment& assignment) const {
  const std::size_t common = std::min(part.steps.size(), assignment.target.accessors.size());
  for (std::size_t i = 0; i < common; ++i) {
    const Part::Step& step = part.steps[i];
    const Accessor& accessor = assignment.target.accessors[i];
    if (step.field != accessor.field) return false;
    const auto index = accessor.field.empty() ? ValueOf(accessor.index).number : std::nullopt;
    if (step.index && index && static_cast<int>(index->value) != *step.index) return false;
  }
  return true;
}

std::string Values::TypeOf(Range range, const Context& context) {
  if (range.empty()) return "";
  const TokenFile& file = *range.file;
  if (const auto point = declarations_.PointAt(file, range.begin)) {
    return program_.points[*point].kind == PointKind::kPose ? "robtarget" : "jointtarget";
  }
  if (!file.IsWord(range.begin)) return "";
  const std::string name = Lowered(file.Text(range.begin));
  if (file.IsSign(range.begin + 1, '(') && range.end > range.begin + 1) {
    if (const auto routine = declarations_.FindRoutine(name, context.scope)) {
      return declarations_.routines[*routine].type;
    }
    return Contains(kPoseFunctions, name)    ? "robtarget"
           : Contains(kJointFunctions, name) ? "jointtarget"
                                             : "";
  }
  const Designator designator = DesignatorAt(file, range.begin, range.end);
  const Parameter* const parameter = ParameterOf(name, context);
  if (parameter != nullptr && designator.accessors.empty()) return parameter->type;
  if (const auto part = PartOf(designator, context)) {
    const auto [type, dimensions] = TypeOf(*part);
    return dimensions == 0 ? type : "";
  }
  return name == "tool0" ? "tooldata" : name == "wobj0" ? "wobjdata" : "";
}

std::vector<std::size_t> Values::PointsIn(const Part& part) {
  std::vector<std::size_t> points;
  const auto [type, dimensions] = TypeOf(part);
  if (IsPointType(type) && dimensions == 0) {
    Part whole = part;
    while (!IsTarget(whole)) whole.steps.pop_back();
    for (const Target& target : TargetsOfPart(whole, {})) {
      if (target.point) points.push_back(*target.point);
    }
    return points;
  }
  std::vector<const Value*> open = ValuesOf(part);
  while (!open.empty()) {
    const Value* const value = open.back();
    open.pop_back();
    if (value->point) points.push_back(*value->point);
    for (const Value& one : value->parts) open.push_back(&one);
  }
  return points;
}

Setting Values::SettingOf(Range range, const std::string& type, const Context& context) {
  if (range.empty()) return {"", "no value"};
  const TokenFile& file = *range.file;
  const std::string text(file.Text(range.begin, range.end));
  if (!file.IsWord(range.begin)) return {"", fmt::format("{} is an expression", text)};
  const Designator designator = DesignatorAt(file, range.begin, range.end);
  if (designator.range.end != range.end) {
    return {"", fmt::format("{} is known only at run time", text)};
  }
  if (context.instance != nullptr && designator.accessors.empty()) {
    const auto bound = context.instance->bound.find(designator.name);
    if (bound != context.instance->bound.end() && bound->second.setting) {
      return *bound->second.setting;
    }
  }
  const auto part = PartOf(designator, context);
  if (!part) {
    if (ParameterOf(designator.name, context) != nullptr) {
      return {"", fmt::format("{} is a parameter whose argument is not known", text)};
    }
    const bool built_in = designator.name == "tool0" || designator.name == "wobj0";
    if (designator.name == "load0") return {};
    return {built_in ? designator.name : text, ""};
  }
  const Data& data = declarations_.data[part->data];
  std::string key = data.name;
  for (const Part::Step& step : part->steps) {
    if (step.field.empty() && !step.index) {
      return {"", fmt::format("{}: the index is known only at run time", text)};
    }
    key += step.field.empty() ? fmt::format("{{{}}}", *step.index) : "." + step.field;
  }
  const auto same =
      std::count_if(declarations_.data.begin(), declarations_.data.end(), [&](const Data& other) {
        return other.type == data.type && SameWord(other.name, data.name);
      });
  if (same > 1) key += fmt::format(" ({})", At(data.place));
  Register(key, type, *part);
  return {key, ""};
}

void Values::Register(const std::string& key, const std::string& type, const Part& part) {
  const bool tool = type == "tooldata", base = type == "wobjdata";
  if (tool   ? program_.tools.count(key)
      : base ? program_.bases.count(key)
             : program_.loads.count(key)) {
    return;
  }
  const Data& data = declarations_.data[part.data];
  const auto values = ValuesOf(part);
  std::string changes = changed_[key];
  if (values.size() != 1) changes = "it has no value in these files";
  for (const Assignment& one : data.assigned) {
    if (MayBe(part, one)) {
      changes = fmt::format("assigned at run time: {}",
                            At(one.target.range.file->PlaceOf(one.target.range.begin)));
    }
  }
  const Value none;
  const Value& value = values.size() == 1 ? *values[0] : none;
  if (!tool && !base) {
    auto load = LoadOf(value);
    if (!changes.empty() || !load) load = LoadValue{};
    load->cog_in_tool = true;
    program_.loads[key] = *load;
    return;
  }
  FrameOf frame = tool ? ToolOf(value) : WorkObjectOf(value);
  frame.value.place = data.place;
  if (!changes.empty()) frame.value.changes = changes;
  if (frame.stationary) stationary_.insert(key);
  (tool ? program_.tools : program_.bases)[key] = std::move(frame.value);
}

void Values::Changed(const Setting& setting, const std::string& why) {
  if (setting.key.empty()) return;
  changed_[setting.key] = why;
  for (auto* const frames : {&program_.tools, &program_.bases}) {
    const auto found = frames->find(setting.key);
    if (found != frames->end()) found->second.changes = why;
  }
  const auto load = program_.loads.find(setting.key);
  if (load != program_.loads.end()) load->second = LoadValue{};
}

void Values::MarkAssigned() {
  for (std::size_t i = 0; i < declarations_.data.size(); ++i) {
    const Data& data = declarations_.data[i];
    if (!declarations_.HoldsPoints(data.type)) continue;
    for (const Assignment& one : data.assigned) {
      Part part{i, {}};
      for (const Accessor& accessor : one.target.accessors) {
        Context context{declarations_.routines[one.routine].scope, nullptr};
        context.scope.routine = one.routine;
        part.steps.push_back(StepOf(accessor, context));
      }
      std::vector<const Value*> open = ValuesOf(part);
      while (!open.empty()) {
        const Value* const value = open.back();
        open.pop_back();
        if (value->point && program_.points[*value->point].untouchable.empty()) {
          program_.points[*value->point].untouchable =
              fmt::format("assigned at run time: {}",
                          At(one.target.range.file->PlaceOf(one.target.range.begin)));
        }
        for (const Value& inner : value->parts) open.push_back(&inner);
      }
    }
  }
}

}  // namespace plumbline::programs::rapid
