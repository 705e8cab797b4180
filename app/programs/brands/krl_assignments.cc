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
  for (std::size_t v = 0; v < variables_.size(); ++v) {
    const Variable& variable = variables_[v];
    const Module& module = modules_[variable.module];
    for (const auto& entry : variable.values) {
      const std::string& path = entry.first;
      const Value& value = entry.second;
      if (!value.point) continue;
      if (variable.shared) program.points[*value.point].visible_to = Visibility::kController;
      if (!program.points[*value.point].untouchable.empty()) continue;
      std::string& reason = program.points[*value.point].untouchable;
      const bool in_data = module.dat && value.place.file == *module.dat;
      const auto other = std::ranges::find_if(variable.writes, [&](const Write& write) {
        if (matches_left_ == 0) return true;
        --matches_left_;
        return Overlap(write.path, path) && !write.Makes(path, value);
      });
      if (variable.parameter) {
        reason = "it is assigned to a parameter of the routine";
      } else if (other != variable.writes.end()) {
        reason = fmt::format("{} is assigned while the program runs, at {}", variable.name + path,
                             Shown(other->place));
      } else if (in_data && !variable.shared && !module.src) {
        reason = fmt::format("{} was not given, which holds the motions to this point: give {}.src",
                             module.name + ".src", module.name);
      }
    }
  }
}

}  // namespace plumbline::programs::krl
