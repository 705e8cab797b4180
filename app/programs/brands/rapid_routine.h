// Routines of RAPID as steps: blocks and jumps become labels, calls with points as arguments become
// a copy of the routine for these arguments.
#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "app/programs/brands/rapid_instructions.h"
#include "app/programs/brands/rapid_values.h"

namespace plumbline::programs::rapid {

/// Writes Program::routines.
class Lowering {
 public:
  /// Steps of all routines together. What is not reached stays as it is, and a remark says so.
  static constexpr std::size_t kMostSteps = 400'000;
  static constexpr std::size_t kMostInstances = 10'000;

  Lowering(const Declarations& declarations, Values& values, Program& program);

  void LowerAll();

 private:
  friend class Body;

  /// Label of a routine for these arguments, which is lowered later; "" beyond the limits.
  std::string Request(Instance instance);
  void LowerPending();
  /// Adds a use of a point, once for each reason.
  void Use(std::size_t point, const Place& place, const std::string& reason,
           std::vector<Step>& steps);
  void Remark(const Place& place, const std::string& text, bool unread = false);
  bool Uses(std::string_view instruction) const;

  const Declarations& declarations_;
  Values& values_;
  Program& program_;
  std::deque<Instance> instances_;  ///< stable addresses
  std::size_t lowered_ = 0;
  std::map<std::string, std::string> labels_;  ///< by routine and arguments
  std::set<std::string> names_;
  std::map<std::string, int> copies_;  ///< by name of the routine
  std::set<std::pair<std::size_t, std::string>> used_;
  std::set<std::string> remarked_;
  std::set<std::string> instructions_;  ///< all words at which a statement may start
  std::set<std::size_t> started_;       ///< routines that are lowered
  std::size_t steps_ = 0;
  bool starting_ = false;
};

}  // namespace plumbline::programs::rapid
