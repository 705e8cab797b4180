// What the routines of all modules have to do with each other: interrupts, and who starts whom.
#include "app/programs/brands/krl_routines.h"

#include <algorithm>

#include "app/programs/brands/krl_routine_reader.h"

namespace plumbline::programs::krl {

void RoutineReader::Read() {
  FindInterrupts();
  FindShifts();
  for (module_ = 0; module_ < names_.modules().size(); ++module_) {
    const Module& module = names_.modules()[module_];
    // What BAS() does is known (Settings).
    if (!module.src || SameWord(module.name, "BAS")) continue;
    std::size_t next = 0;
    routine_.reset();
    ForStatements(program_.files[*module.src], *module.src, lines_[*module.src],
                  [&](const Statement& statement) {
                    if (next < module.routines.size() &&
                        program_.routines[module.routines[next]].place.line <= statement.line) {
                      CloseRoutine();
                      OpenRoutine(module.routines[next++]);
                    } else if (routine_) {
                      ReadStatement(statement);
                    }
                  });
    CloseRoutine();
  }
  FinishInterrupts();
  FindStarts();
}

void RoutineReader::FindInterrupts() {
  for (std::size_t m = 0; m < names_.modules().size(); ++m) {
    const Module& module = names_.modules()[m];
    if (!module.src) continue;
    std::size_t next = 0;
    ForStatements(program_.files[*module.src], *module.src, lines_[*module.src],
                  [&](const Statement& statement) {
                    while (next < module.routines.size() &&
                           program_.routines[module.routines[next]].place.line <= statement.line) {
                      ++next;
                    }
                    if (next > 0 && statement.HasWord(0, "RESUME")) {
                      abandoning_.insert(module.routines[next - 1]);
                    }
                    // [GLOBAL] INTERRUPT DECL n WHEN ... DO name(...)
                    const std::size_t at = statement.HasWord(0, "GLOBAL") ? 1 : 0;
                    if (!statement.HasWord(at, "INTERRUPT") || !statement.HasWord(at + 1, "DECL"))
                      return;
                    const auto number = at + 2 < statement.size()
                                            ? WholeNumberIn(statement.tokens[at + 2].text)
                                            : std::nullopt;
                    for (std::size_t i = at + 3; number && i + 1 < statement.size(); ++i) {
                      if (!statement.HasWord(i, "DO") || !statement.HasAnyWord(i + 1)) continue;
                      const std::string_view name = statement.tokens[i + 1].text;
                      const auto handler = names_.FindRoutine(m, name);
                      if (handler && !IsSystemRoutine(name))
                        handlers_.insert_or_assign(*number, *handler);
                    }
                  });
  }
}

void RoutineReader::FinishInterrupts() {
  std::unordered_map<std::string, std::size_t> by_name;
  for (std::size_t r = 0; r < program_.routines.size(); ++r) {
    by_name.try_emplace(program_.routines[r].name, r);
  }
  const auto reached_from = [&](std::set<std::size_t> reached) {
    std::vector<std::size_t> open(reached.begin(), reached.end());
    while (!open.empty()) {
      const std::size_t r = open.back();
      open.pop_back();
      for (const Step& step : program_.routines[r].steps) {
        if (step.kind != StepKind::kCall) continue;
        const auto called = by_name.find(step.label);
        if (called != by_name.end() && reached.insert(called->second).second) {
          open.push_back(called->second);
        }
      }
    }
    return reached;
  };
  for (const std::size_t r : reached_from({interrupted_.begin(), interrupted_.end()})) {
    for (Step& step : program_.routines[r].steps) {
      if (step.kind == StepKind::kMotion && step.motion.special.empty()) {
        step.motion.special = "search motion: an interrupt that is on here may end it early";
      }
    }
  }
}

void RoutineReader::FindStarts() {
  // A program that no other calls is started by the operator or by CELL; so is one of a circle of
  // programs that call each other.
  std::unordered_map<std::string, std::size_t> by_name;
  for (std::size_t r = 0; r < program_.routines.size(); ++r) {
    by_name.try_emplace(program_.routines[r].name, r);
  }
  std::vector<bool> called(program_.routines.size()), reached(program_.routines.size());
  const auto callees = [&](std::size_t r, const auto& visit) {
    for (const Step& step : program_.routines[r].steps) {
      if (step.kind != StepKind::kCall && step.kind != StepKind::kEnableInterrupt) continue;
      if (const auto found = by_name.find(step.label); found != by_name.end()) visit(found->second);
    }
  };
  for (std::size_t r = 0; r < program_.routines.size(); ++r) {
    callees(r, [&](std::size_t callee) { called[callee] = called[callee] || callee != r; });
  }
  const auto start = [&](std::size_t first) {
    program_.routines[first].starts = true;
    std::vector<std::size_t> open = {first};
    reached[first] = true;
    while (!open.empty()) {
      const std::size_t r = open.back();
      open.pop_back();
      callees(r, [&](std::size_t callee) {
        if (!reached[callee]) open.push_back(callee);
        reached[callee] = true;
      });
    }
  };
  for (std::size_t r = 0; r < called.size(); ++r) {
    if (!called[r]) start(r);
  }
  for (std::size_t r = 0; r < called.size(); ++r) {
    if (!reached[r]) start(r);
  }
}

void ReadRoutines(Reading& reading, Names& names, const std::vector<LineIndex>& lines) {
  RoutineReader reader(reading, names, lines);
  reader.Read();
  if (!names.exhausted() && !reader.exhausted()) return;
  for (Point& point : reading.program.points) {
    if (point.untouchable.empty()) {
      point.untouchable =
          "the program has too many uses of array elements to follow them all: give fewer modules "
          "at a time";
    }
  }
}

}  // namespace plumbline::programs::krl
