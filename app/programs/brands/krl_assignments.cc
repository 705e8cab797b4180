// What the running program assigns, and which points it therefore does not leave alone.
#include <fmt/format.h>

#include <algorithm>

#include "app/programs/brands/krl_names.h"

namespace plumbline::programs::krl {

void Names::ReadAssignment(const Statement& statement, std::size_t module,
                           std::optional<std::size_t> routine) {
  const auto write_to = [&](const Reference& reference, std::size_t token) {
    std::size_t index = 0;
    if (reference.variable) {
      index = *reference.variable;
    } else {
      index = Declare(statement.tokens[token].text, module, std::nullopt);
    }
    std::string path = reference.path;
    if (!reference.component.empty()) path += "." + reference.component;
    variables_[index].writes.push_back({path, statement.place(), false});
    return index;
  };
  if (statement.HasWord(0, "FOR") && statement.HasAnyWord(1)) {
    std::size_t at = 1;
    write_to(TakeReference(statement, module, routine, at), 1);
    return;
  }
  const bool names = statement.HasAnyWord(0) && !IsKeyword(statement.tokens[0].text);
  std::size_t at = 0;
  if (names && (statement.Has(1, '=') || statement.Has(1, '[') || statement.Has(1, '.'))) {
    const Reference reference = TakeReference(statement, module, routine, at);
    if (statement.Has(at, '=') && !statement.Has(at + 1, '=')) {
      const std::size_t index = write_to(reference, 0);
      ++at;
      const std::size_t value = at;
      if (statement.Has(value, '{') && reference.component.empty() &&
          statement.Behind(value, statement.size()) == statement.size() &&
          !variables_[index].name.starts_with('$')) {
        const auto aggregate = TakeAggregate(statement, Bytes(statement.file), at);
        if (aggregate && IsPoint(*aggregate)) {
          variables_[index].writes.back().literal = true;
          // A second value of the same part is a point of its own, which nothing can be said of.
          const std::string path = reference.path;
          if (variables_[index].values.contains(path)) {
            const std::size_t point = AddPoint(*aggregate, IsJoints(*aggregate),
                                               variables_[index].name + path, statement.place());
            reading_.program.points[point].untouchable =
                fmt::format("{} has another value at {}", variables_[index].name + path,
                            Shown(variables_[index].values.at(path).place));
          } else {
            AddAggregate(index, path, *aggregate, statement.place());
          }
        }
        return;
      }
    }
  }
  // Arguments are given by reference: the routine may change them.
  for (std::size_t i = 0; i + 1 < statement.size(); ++i) {
    if (!statement.HasAnyWord(i) || !statement.Has(i + 1, '(')) continue;
    const std::string_view name = statement.tokens[i].text;
    if (IsSystemRoutine(name) || IsKeyword(name) || statement.HasWord(0, "DEF") ||
        statement.HasWord(0, "DEFFCT") || statement.HasWord(0, "GLOBAL") ||
        statement.HasWord(0, "EXT") || statement.HasWord(0, "EXTFCT")) {
      continue;
    }
    if (!FindRoutine(module, name) && missing_routine_.empty() && !Find(name, module, routine)) {
      missing_routine_ = name;
    }
    const std::size_t end = statement.Behind(i + 1, statement.size());
    for (std::size_t begin = i + 2; begin < end;) {
      const std::size_t next = statement.Find(',', begin, end);
      std::size_t behind = begin;
      if (statement.HasAnyWord(begin)) {
        const Reference reference = TakeReference(statement, module, routine, behind);
        const bool alone = behind == next || behind + 1 == end;
        if (alone && reference.variable) write_to(reference, begin);
      }
      begin = next + 1;
    }
  }
}

void Names::ReadAssignments(const std::vector<LineIndex>& lines) {
  for (std::size_t m = 0; m < modules_.size(); ++m) {
    // What BAS() does is known; its module adapts home positions of other kinematics.
    if (!modules_[m].src || SameWord(modules_[m].name, "BAS")) continue;
    const std::size_t file = *modules_[m].src;
    std::size_t next = 0;
    std::optional<std::size_t> routine;
    ForStatements(reading_.program.files[file], file, lines[file], [&](const Statement& statement) {
      const auto& routines = modules_[m].routines;
      while (next < routines.size() &&
             reading_.program.routines[routines[next]].place.line <= statement.line) {
        routine = routines[next++];
      }
      ReadAssignment(statement, m, routine);
    });
  }
}

void Names::MarkUntouchable() {
  Program& program = reading_.program;
  // Whoever gives both folders of an archive, and everything that is called from there, has given
  // all modules that can name a public point.
  bool system = false, programs = false;
  for (const SourceFile& file : program.files) {
    std::string name = Lowered(file.name);
    std::ranges::replace(name, '\\', '/');
    system = system || name.find("r1/system/") != std::string::npos;
    programs = programs || name.find("r1/program/") != std::string::npos;
  }
  const bool complete = system && programs && missing_routine_.empty();
  for (std::size_t v = 0; v < variables_.size(); ++v) {
    const Variable& variable = variables_[v];
    const Module& module = modules_[variable.module];
    for (const auto& entry : variable.values) {
      const std::string& path = entry.first;
      const Value& value = entry.second;
      if (!value.point || !program.points[*value.point].untouchable.empty()) continue;
      std::string& reason = program.points[*value.point].untouchable;
      const bool in_data = module.dat && value.place.file == *module.dat;
      const auto other = std::ranges::find_if(variable.writes, [&](const Write& write) {
        if (matches_left_ == 0) return true;
        --matches_left_;
        return Overlap(write.path, path) &&
               !(write.literal && write.path == path && write.place.line == value.place.line &&
                 write.place.file == value.place.file);
      });
      if (variable.parameter) {
        reason = "it is assigned to a parameter of the routine";
      } else if (other != variable.writes.end()) {
        reason = fmt::format("{} is assigned while the program runs, at {}", variable.name + path,
                             Shown(other->place));
      } else if (variable.shared && !complete) {
        reason = fmt::format(
            "module {} is public, and other programs of the controller may use this point: give "
            "the folders KRC/R1/Program and KRC/R1/System of its archive{}",
            module.name,
            missing_routine_.empty() || !(system && programs)
                ? ""
                : fmt::format(", also with the routine {}", missing_routine_));
      } else if (in_data && !variable.shared && !module.src) {
        reason = fmt::format("{} was not given, which holds the motions to this point: give {}.src",
                             module.name + ".src", module.name);
      }
    }
  }
}

}  // namespace plumbline::programs::krl
