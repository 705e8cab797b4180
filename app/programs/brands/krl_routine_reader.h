// Reader of the statements of KRL routines, shared by the sources that hold its parts.
#pragma once

#include <fmt/format.h>

#include <set>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "app/programs/brands/krl_names.h"
#include "app/programs/brands/krl_routines.h"
#include "app/programs/brands/krl_settings.h"

namespace plumbline::programs::krl {

/// A block that is open at a line: its labels are where END..., ELSE or CASE lead.
struct Block {
  std::string_view kind;  ///< "if", "for", "while", "loop", "repeat", "switch"
  std::string top, next, end;
};

class RoutineReader {
 public:
  RoutineReader(Reading& reading, Names& names, const std::vector<LineIndex>& lines)
      : program_(reading.program), names_(names), settings_(reading, names), lines_(lines) {}

  void Read();

 private:
  void FindInterrupts();
  void ReadStatement(const Statement& statement);
  void OpenRoutine(std::size_t routine);
  void CloseRoutine();
  bool ReadBlock(const Statement& statement);
  void OpenBlock(std::string_view kind);
  std::optional<Block> CloseBlock(const Statement& statement, std::string_view kind);
  void ReadInterrupt(const Statement& statement);
  void ReadAssignment(const Statement& statement, std::size_t equals);
  void ReadBas(const Statement& statement);
  void ReadMotion(const Statement& statement, const MotionStatement& form);
  void ReadWith(const Statement& statement, std::size_t begin, Motion& motion);
  std::vector<Target> TargetsOf(const Statement& statement, std::size_t begin, std::size_t end);
  std::vector<Target> ChainTargets(const Statement& statement, std::size_t begin, std::size_t end);
  void EmitMotion(const Statement& statement, Motion motion, const std::vector<Target>& vias,
                  const std::vector<Target>& ends);
  void Use(const Statement& statement, std::size_t begin, std::size_t end, std::string_view how,
           bool calls = true);
  void Call(const Statement& statement, std::string_view name);
  void Apply(const Statement& statement, const Frames& frames);
  void FinishInterrupts();
  void FindShifts();
  void Shift(Place place, std::string why, bool uses_other);
  void FindStarts();

  Step& Emit(StepKind kind, Place place) {
    auto& steps = program_.routines[*routine_].steps;
    steps.emplace_back();
    steps.back().kind = kind;
    steps.back().place = place;
    return steps.back();
  }
  void Label(const std::string& label, Place place) { Emit(StepKind::kLabel, place).label = label; }
  void Jump(StepKind kind, const std::string& label, Place place) {
    Emit(kind, place).label = label;
  }
  void Set(StepKind kind, Place place, Setting setting) {
    Emit(kind, place).setting = std::move(setting);
  }
  std::string NewLabel() { return fmt::format(".{}", ++labels_); }

  Program& program_;
  Names& names_;
  Settings settings_;
  const std::vector<LineIndex>& lines_;

  std::size_t module_ = 0;
  std::optional<std::size_t> routine_;
  std::vector<Block> blocks_;
  int labels_ = 0;
  std::string broken_;            ///< why the blocks of the routine do not match
  std::optional<Frames> fdat_;    ///< what FDAT_ACT holds, if this is known here
  std::optional<Motion> spline_;  ///< settings of the spline block
  bool in_spline_ = false;
  bool uses_stationary_ = false, uses_soft_servo_ = false;  ///< any of the files
  std::set<std::int64_t> active_;  ///< interrupts that are on and may end a motion early
  std::unordered_map<std::int64_t, std::size_t> handlers_;
  std::unordered_set<std::size_t> abandoning_;  ///< routines with RESUME, which abandons the motion
  std::unordered_set<std::size_t> interrupted_;  ///< routines called while such an interrupt is on
  std::unordered_set<std::size_t> used_;         ///< points other than as targets
  static constexpr std::size_t kMostAlternatives = 200000;
  std::size_t alternatives_left_ = kMostAlternatives;

 public:
  bool exhausted() const { return alternatives_left_ == 0; }
};

}  // namespace plumbline::programs::krl
