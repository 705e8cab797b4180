#include "app/programs/brands/rapid_routine.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/programs/brands/rapid_body.h"

namespace plumbline::programs::rapid {

namespace {

/// A text that is equal for equal arguments.
std::string KeyOf(const Instance& instance) {
  std::string key = std::to_string(instance.routine);
  for (const auto& [name, binding] : instance.bound) {
    key += "|" + name;
    for (const Target& target : binding.targets) {
      key += target.point ? ";" + std::to_string(*target.point) : ";?" + target.computed;
      if (target.offset.in != Offset::In::kNone) {
        key += fmt::format("@{}{}", static_cast<int>(target.offset.in), target.offset.unknown);
        for (const double value : target.offset.X.p) key += fmt::format(",{}", value);
        for (const double value : target.offset.X.R.reshaped()) key += fmt::format(",{}", value);
      }
    }
    if (binding.setting) key += "=" + binding.setting->key + "?" + binding.setting->unknown;
    if (binding.number) key += fmt::format("#{}", *binding.number);
    key += ":" + binding.word;
    if (!binding.part) continue;
    key += fmt::format("[{}", binding.part->data);
    for (const Part::Step& step : binding.part->steps) {
      key += fmt::format(".{}{}", step.field, step.index.value_or(0));
    }
  }
  return key;
}

}  // namespace

Lowering::Lowering(const Declarations& declarations, Values& values, Program& program)
    : declarations_(declarations), values_(values), program_(program) {
  for (const RoutineText& routine : declarations_.routines) {
    const TokenFile& file = *routine.body.file;
    for (std::size_t i = routine.body.begin; i < routine.body.end; ++i) {
      if (file.IsWord(i)) instructions_.insert(Lowered(file.Text(i)));
    }
  }
}

bool Lowering::Uses(std::string_view instruction) const {
  return instructions_.count(std::string(instruction)) > 0;
}

void Lowering::Remark(const Place& place, const std::string& text, bool unread) {
  constexpr std::size_t kMostRemarks = 1000;
  if (remarked_.size() < kMostRemarks && remarked_.insert(text).second) {
    program_.remarks.push_back({place, text, unread});
  }
}

void Lowering::Use(std::size_t point, const Place& place, const std::string& reason,
                   std::vector<Step>& steps) {
  if (!used_.emplace(point, reason).second) return;
  Step step;
  step.kind = StepKind::kUse;
  step.place = place;
  step.point = point;
  step.reason = reason;
  steps.push_back(std::move(step));
  ++steps_;
}

std::string Lowering::Request(Instance instance) {
  const std::string key = KeyOf(instance);
  const auto known = labels_.find(key);
  if (known != labels_.end()) return known->second;
  const RoutineText& text = declarations_.routines[instance.routine];
  if (instances_.size() >= kMostInstances || steps_ >= kMostSteps) {
    Remark(text.place,
           fmt::format("{} is called with too many different arguments to be followed", text.name));
    return "";
  }
  std::string label = text.name;
  for (int& copies = copies_[label]; !names_.insert(label).second;) {
    label = fmt::format("{} ({})", text.name, ++copies + 1);
  }
  instance.label = label;
  started_.insert(instance.routine);
  labels_[key] = label;
  Routine routine;
  routine.name = label;
  routine.place = text.place;
  routine.starts = starting_;
  program_.routines.push_back(std::move(routine));
  instances_.push_back(std::move(instance));
  return label;
}

void Lowering::LowerPending() {
  for (; lowered_ < instances_.size(); ++lowered_) {
    program_.routines[lowered_].steps = StepsOf(*this, instances_[lowered_]);
  }
}

void Lowering::LowerAll() {
  const auto start = [&](std::size_t i) {
    if (started_.count(i) > 0) return;
    Instance instance;
    instance.routine = i;
    starting_ = true;
    Request(std::move(instance));
    starting_ = false;
    LowerPending();
  };
  const auto& routines = declarations_.routines;
  // main, then what interrupts start, then what nobody calls, then what only calls itself.
  for (std::size_t i = 0; i < routines.size(); ++i) {
    if (!SameWord(routines[i].name, "main")) continue;
    program_.has_main = true;
    start(i);
  }
  for (std::size_t i = 0; i < routines.size(); ++i) {
    if (routines[i].trap) start(i);
  }
  for (std::size_t i = 0; i < routines.size(); ++i) {
    if (!Uses(Lowered(routines[i].name))) start(i);
  }
  for (std::size_t i = 0; i < routines.size(); ++i) start(i);
}

}  // namespace plumbline::programs::rapid
