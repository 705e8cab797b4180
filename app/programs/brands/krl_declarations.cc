// Modules and what they declare.
#include <fmt/format.h>

#include <algorithm>

#include "app/programs/brands/krl_names.h"

namespace plumbline::programs::krl {
namespace {

/// Variables of the controller whose frames are settings, masses or machine data.
bool IsSystemData(const Variable& variable) {
  return variable.name.starts_with('$') || SameWord(variable.name, "TOOL_DATA") ||
         SameWord(variable.name, "BASE_DATA") || variable.type == "load" ||
         variable.type == "inertia";
}

}  // namespace

void Names::FindModules(const std::vector<LineIndex>& lines) {
  Program& program = reading_.program;
  std::unordered_map<std::string, std::size_t> by_name;
  module_of_file_.resize(program.files.size());
  for (std::size_t file = 0; file < program.files.size(); ++file) {
    std::optional<Statement> head;
    ForStatements(program.files[file], file, lines[file], [&](const Statement& statement) {
      for (std::size_t at = 0; !head && at < statement.size(); ++at) {
        if (statement.HasWord(at, "DEF") || statement.HasWord(at, "DEFDAT") ||
            statement.HasWord(at, "DEFFCT")) {
          head = statement;
          head->tokens.erase(head->tokens.begin(),
                             head->tokens.begin() + static_cast<std::ptrdiff_t>(at));
        }
      }
    });
    if (!head || !head->HasAnyWord(1)) {
      reading_.refusals.push_back({file, 1, "a KRL file without DEF or DEFDAT",
                                   "give the .src or .dat file as the controller archives it"});
      continue;
    }
    const bool data = head->HasWord(0, "DEFDAT");
    // DEFFCT TYPE NAME(...): the name stands before the parenthesis.
    std::size_t at = 1;
    while (!data && head->HasAnyWord(at + 1)) ++at;
    const std::string_view name = head->tokens[at].text;
    const auto [entry, added] = by_name.try_emplace(Lowered(name), modules_.size());
    if (added) modules_.push_back({std::string(name), {}, {}, false, {}, {}, {}});
    Module& module = modules_[entry->second];
    std::optional<std::size_t>& slot = data ? module.dat : module.src;
    if (slot && name.starts_with('$')) {
      program.remarks.push_back({{file, head->line},
                                 fmt::format("a second {}, besides {}: it is left out", name,
                                             program.files[*slot].name)});
      continue;
    }
    if (slot) {
      reading_.refusals.push_back(
          {file, head->line,
           fmt::format("a second module {}, besides {}", name, program.files[*slot].name),
           "give each module of one controller once"});
      continue;
    }
    slot = file;
    module_of_file_[file] = entry->second;
    if (data) module.is_public = head->HasWord(2, "PUBLIC") || name.starts_with('$');
  }
}

void Names::ReadStructure(const Statement& statement) {
  std::size_t at = 0;
  while (at < statement.size() && !statement.HasWord(at, "STRUC")) ++at;
  if (!statement.HasAnyWord(at + 1)) return;
  auto& members = structures_[Lowered(statement.tokens[at + 1].text)];
  std::string type;
  for (at += 2; at < statement.size(); ++at) {
    if (!statement.HasAnyWord(at)) continue;
    if (statement.HasAnyWord(at + 1)) {
      type = Lowered(statement.tokens[at].text);
    } else {
      members[Lowered(statement.tokens[at].text)] = type;
      if (statement.Has(at + 1, '[')) at = statement.Behind(at + 1, statement.size()) - 1;
    }
  }
}

std::size_t Names::AddPoint(const Aggregate& aggregate, bool joints, std::string name,
                            Place place) {
  Program& program = reading_.program;
  Point point;
  point.name = std::move(name);
  point.place = place;
  point.kind = joints ? PointKind::kJoints : PointKind::kPose;
  point.numbers.resize(6);
  point.external_axes.resize(6);
  bool zero = true;
  for (const Aggregate::Member& member : aggregate.members) {
    const auto index = IndexIn(joints ? kJointComponents : kPoseComponents, member.name);
    if (index && !point.numbers[*index]) {
      if (!member.number) point.untouchable = "one of its numbers is not written in decimals";
      point.numbers[*index] = member.number;
      zero = zero && member.number && member.number->value == 0;
    } else if (const auto external = IndexIn(kExternalComponents, member.name)) {
      point.external_axes[*external] = member.number;
    } else if (!joints && (member.name == "s" || member.name == "t")) {
      point.configuration.fields.push_back(
          {member.name == "s" ? "S" : "T", member.span, std::string(member.text)});
      const auto bits = WholeNumberIn(member.text);
      // Bit 4 of the status: taught under the absolutely accurate model [robot-forum 36602].
      if (member.name == "s" && bits && *bits >= 0) point.absolutely_accurate = (*bits & 16) != 0;
    }
  }
  if (point.untouchable.empty() && zero && !joints &&
      std::ranges::all_of(point.numbers, [](const auto& number) { return number.has_value(); })) {
    point.untouchable = "all its numbers are zero: it was not taught";
  }
  program.points.push_back(std::move(point));
  return program.points.size() - 1;
}

void Names::AddAggregate(std::size_t index, const std::string& path, const Aggregate& aggregate,
                         Place place) {
  Variable& variable = variables_[index];
  const std::string type = aggregate.type.empty() ? TypeAt(variable, path) : aggregate.type;
  Value value;
  value.place = place;
  value.text = Bytes(aggregate.span.file)
                   .substr(aggregate.span.begin, aggregate.span.end - aggregate.span.begin);
  const bool joints = IsJoints(aggregate);
  if (IsPoint(aggregate) && !joints) {
    value.is_pose = true;
    for (const Aggregate::Member& member : aggregate.members) {
      const auto component = IndexIn(kPoseComponents, member.name);
      if (component) value.pose[*component] = member.number;
    }
  }
  const bool known = IsPoseType(type) || IsJointType(type);
  const bool mass =
      type == "load" || type == "inertia" || path.ends_with(".cm") || path.ends_with(".j");
  if (IsPoint(aggregate) && !IsSystemData(variable) && !mass) {
    const std::size_t point = AddPoint(aggregate, joints, variable.name + path, place);
    value.point = point;
    std::string& untouchable = reading_.program.points[point].untouchable;
    if (!known && untouchable.empty()) {
      untouchable =
          variable.declared
              ? fmt::format("it is part of a structure ({}) whose declaration was not given",
                            variable.type)
              : fmt::format("{} is not declared in these files: give the .dat file of its module",
                            variable.name);
    }
  }
  for (const Aggregate::Member& member : aggregate.members) {
    const std::string inner = path + "." + member.name;
    if (!member.nested.empty()) {
      AddAggregate(index, inner, member.nested.front(), place);
    } else if (!known) {
      Value scalar;
      scalar.place = place;
      scalar.text = member.text;
      if (member.number) scalar.number = member.number->value;
      variables_[index].values.try_emplace(inner, std::move(scalar));
    }
  }
  variables_[index].values.try_emplace(path, std::move(value));
}

void Names::AddValue(std::size_t variable, const std::string& path, const Statement& statement,
                     std::size_t& at) {
  const std::string_view bytes = Bytes(statement.file);
  if (statement.Has(at, '{')) {
    const std::size_t begin = at;
    if (const auto aggregate = TakeAggregate(statement, bytes, at)) {
      AddAggregate(variable, path, *aggregate, statement.place());
    } else {
      at = statement.Behind(begin, statement.size());
      reading_.program.remarks.push_back(
          {statement.place(),
           fmt::format("{}: this value is not understood", variables_[variable].name + path)});
    }
    return;
  }
  const std::size_t begin = at;
  at = statement.Find(',', at, statement.size());
  Value value;
  value.place = statement.place();
  value.text = statement.Text(begin, at, bytes);
  SourceCursor cursor(value.text, 0);
  const auto number = cursor.TakeNumber();
  if (number && cursor.AtEnd()) value.number = number->value;
  variables_[variable].values.insert_or_assign(path, std::move(value));
}

void Names::ReadDeclaration(const Statement& statement, std::size_t module,
                            std::optional<std::size_t> routine, bool data) {
  std::size_t at = 0;
  bool global = modules_[module].name.starts_with('$');  // $CONFIG, $MACHINE
  bool marked = false;
  while (statement.HasWord(at, "DECL") || statement.HasWord(at, "GLOBAL") ||
         statement.HasWord(at, "CONST")) {
    global = global || statement.HasWord(at, "GLOBAL");
    marked = true;
    ++at;
  }
  if (!statement.HasAnyWord(at)) return;
  const Token& type = statement.tokens[at];
  if (type.IsWord("STRUC")) return;
  if (type.IsWord("EXT") || type.IsWord("EXTFCT") || type.IsWord("SIGNAL") || type.IsWord("ENUM") ||
      type.IsWord("INTERRUPT") || type.IsWord("DEFDAT") || type.IsWord("ENDDAT")) {
    return;
  }
  if (type.IsWord("IMPORT")) {
    // IMPORT TYPE NAME IS /R1/MODULE..NAME
    imports_.emplace_back(fmt::format("{}", module), statement);
    return;
  }
  if (!statement.HasAnyWord(at + 1)) {
    // DECL NAME=VALUE and NAME=VALUE give values to what the controller has declared.
    if (!data) return;
    const std::size_t index = Declare(type.text, module, routine);
    if (global) globals_.try_emplace(Lowered(type.text), index);
    std::string path;
    ++at;
    if (statement.Has(at, '[')) {
      const std::size_t behind = statement.Behind(at, statement.size());
      path = IndexPath(statement, at, behind);
      at = behind;
    }
    if (statement.Has(at, '=')) AddValue(index, path, statement, ++at);
    return;
  }
  if (!marked && !data && !IsType(type.text) && !structures_.contains(Lowered(type.text))) return;
  ++at;
  while (statement.HasAnyWord(at)) {
    const std::string_view name = statement.tokens[at].text;
    const std::size_t index = Declare(name, module, routine);
    Variable& variable = variables_[index];
    variable.declared = true;
    variable.type = Lowered(type.text);
    variable.place = statement.place();
    variable.shared = !routine && (global || modules_[module].is_public);
    if (global) globals_.try_emplace(Lowered(name), index);
    std::string path;
    if (statement.Has(++at, '[')) {
      const std::size_t behind = statement.Behind(at, statement.size());
      // In `E6POS P[3]` the bracket is the size, in `E6POS P[3]={...}` it is an element.
      path = IndexPath(statement, at, behind);
      at = behind;
    }
    if (statement.Has(at, '=')) AddValue(index, path, statement, ++at);
    if (!statement.Has(at, ',')) break;
    ++at;
  }
}

void Names::ReadDeclarations(const std::vector<LineIndex>& lines) {
  Program& program = reading_.program;
  for (std::size_t file = 0; file < program.files.size(); ++file) {
    if (!module_of_file_[file]) continue;
    ForStatements(program.files[file], file, lines[file], [&](const Statement& statement) {
      for (std::size_t at = 0; at < 3; ++at) {
        if (statement.HasWord(at, "STRUC")) ReadStructure(statement);
      }
    });
  }
  for (std::size_t file = 0; file < program.files.size(); ++file) {
    if (!module_of_file_[file]) continue;
    const std::size_t m = *module_of_file_[file];
    const bool data = modules_[m].dat == file;
    std::optional<std::size_t> routine;
    ForStatements(program.files[file], file, lines[file], [&](const Statement& statement) {
      std::size_t at = statement.HasWord(0, "GLOBAL") ? 1 : 0;
      const bool function = statement.HasWord(at, "DEFFCT");
      if (data || !(statement.HasWord(at, "DEF") || function)) {
        ReadDeclaration(statement, m, routine, data);
        return;
      }
      std::size_t name = at + 1;
      while (statement.HasAnyWord(name + 1) || (function && statement.Has(name + 1, '[')) ||
             (function && statement.Has(name + 1, ']'))) {
        ++name;
      }
      if (!statement.HasAnyWord(name)) return;
      const std::string_view text = statement.tokens[name].text;
      routine = program.routines.size();
      locals_.emplace_back();
      const bool main = modules_[m].routines.empty();
      modules_[m].routines.push_back(*routine);
      modules_[m].local_routines.try_emplace(Lowered(text), *routine);
      Routine made;
      made.name = fmt::format("{}/{}", modules_[m].name, text);
      if ((main || at == 1) && global_routines_.try_emplace(Lowered(text), *routine).second) {
        made.name = text;
      }
      made.place = statement.place();
      program.routines.push_back(std::move(made));
      for (std::size_t i = name + 1; i < statement.size(); ++i) {
        if (!(statement.Has(i, '(') || statement.Has(i, ',')) || !statement.HasAnyWord(i + 1)) {
          continue;
        }
        const std::size_t parameter = Declare(statement.tokens[i + 1].text, m, routine);
        variables_[parameter].parameter = true;
      }
    });
  }
  for (const auto& [module, statement] : imports_) {
    std::size_t at = 0;
    while (at < statement.size() && !statement.HasWord(at, "IS")) ++at;
    const std::size_t last = statement.size() - 1;
    if (at < 2 || at >= last || !statement.HasAnyWord(last)) continue;
    // The module is the word in front of "..".
    std::size_t before = last;
    while (before > at && statement.Has(before - 1, '.')) --before;
    if (before <= at + 1 || !statement.HasAnyWord(before - 1)) continue;
    std::string_view own = statement.tokens[at - 1].text;
    for (std::size_t i = 1; i < at; ++i) {
      if (statement.Has(i, '[')) own = statement.tokens[i - 1].text;
    }
    for (const Module& source : modules_) {
      if (!SameWord(source.name, statement.tokens[before - 1].text)) continue;
      const auto found = source.variables.find(Lowered(statement.tokens[last].text));
      if (found == source.variables.end()) continue;
      const auto target = static_cast<std::size_t>(*WholeNumberIn(module));
      modules_[target].variables.insert_or_assign(Lowered(own), found->second);
    }
  }
}

}  // namespace plumbline::programs::krl
