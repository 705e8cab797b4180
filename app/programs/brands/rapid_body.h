// The statements of one routine of RAPID as steps.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "app/programs/brands/rapid_routine.h"

namespace plumbline::programs::rapid {

/// Walks through the statements of a routine.
class Body {
 public:
  Body(Lowering& lowering, const Instance& instance)
      : lowering_(lowering),
        values_(lowering.values_),
        text_(lowering.declarations_.routines[instance.routine]),
        file_(*text_.body.file),
        context_{text_.scope, &instance} {
    context_.scope.routine = instance.routine;
  }

  std::vector<Step> Run();

 private:
  /// An open IF, FOR, WHILE or TEST.
  struct Block {
    std::string top;   ///< of a loop
    std::string next;  ///< of the next alternative; "" if there is none
    std::string end;
  };

  std::size_t Statement(std::size_t at);
  std::size_t Section(std::size_t at);
  std::size_t If(std::size_t at);
  void Simple(Range statement);
  void Connect(Range statement);
  void Instruction(Range statement);
  void Move(const MotionInstruction& instruction, Range statement,
            const std::vector<Argument>& arguments);
  Motion MotionOf(const MotionInstruction& instruction, const std::vector<Argument>& arguments,
                  const std::vector<Range>& required, std::size_t after_targets);
  void SetState(const std::string& name, Range statement, const std::vector<Argument>& arguments);
  void CallLate(Range statement);
  void CallMissing(std::string name);
  void CallNamed(Range name);
  void Call(std::size_t routine, const std::vector<Argument>& arguments, const Place& place);
  Binding BindingOf(const Parameter& parameter, const RoutineText& routine, Range value);
  /// All points in an expression are used for `reason`; functions in it are called.
  void UseAll(Range range, const std::string& reason);
  /// Of an expression that is a target, everything but the target itself: indices, displacements,
  /// and what functions do with their arguments.
  void UseBesideTarget(Range range);
  void UseTargets(const std::vector<Target>& targets, const Place& place,
                  const std::string& reason);
  bool Given(const Argument& argument) const;
  const Argument* Optional(const std::vector<Argument>& arguments, std::string_view name) const;
  bool StopsAt(Range zone) const;

  Step& Add(StepKind kind, const Place& place, const std::string& label = "");
  /// A name that the routine gives twice, which RAPID does not allow, means its first place.
  void Label(const std::string& label) {
    if (labels_.insert(label).second) Add(StepKind::kLabel, place_, label);
  }
  void Jump(const std::string& label) { Add(StepKind::kJump, place_, label); }
  void Branch(const std::string& label) { Add(StepKind::kBranch, place_, label); }
  /// From here, execution does not go on.
  void Halt() {
    const std::string here = NewLabel();
    Label(here);
    Jump(here);
  }
  /// An error may have led from here to the error handler.
  void MayFail() {
    if (text_.handles_errors && !in_handler_) Branch("ERROR");
  }
  std::string NewLabel() { return fmt::format("{}", ++label_count_); }
  std::size_t EndOf(std::size_t at) const;
  std::size_t EndOfCondition(std::size_t at) const;
  void CloseLabels();

  Lowering& lowering_;
  Values& values_;
  const RoutineText& text_;
  const TokenFile& file_;
  Context context_;
  std::vector<Step> steps_;
  std::vector<Block> blocks_;
  std::set<std::string> labels_;
  Place place_;
  int label_count_ = 0;
  int depth_ = 0;
  bool in_handler_ = false;
  bool handler_acts_ = false;    ///< it moves the robot or changes what holds
  bool whole_statement_ = true;  ///< a statement could be inserted before this one
};

/// @param instance  a routine with the values of its parameters
std::vector<Step> StepsOf(Lowering& lowering, const Instance& instance);

}  // namespace plumbline::programs::rapid
