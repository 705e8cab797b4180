#include "app/programs/flow/flow.h"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <set>
#include <unordered_map>
#include <utility>

#include "app/programs/flow/facts.h"

namespace plumbline::programs {

std::string PlaceText(const Program& program, const Place& place) {
  const bool known = place.file < program.files.size();
  return fmt::format("{}:{}", known ? program.files[place.file].name : std::string("?"),
                     place.line);
}

namespace {

std::string Lowered(std::string text) {
  for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return text;
}

std::string StartedName(const Routine& routine) {
  return routine.name.empty() ? "the program" : routine.name;
}

class Analysis {
 public:
  Analysis(const Program& program, const EntryState& entry)
      : program_(program), entry_(entry), facts_(program) {}

  Flow Run() {
    for (const std::string& name : entry_.harmless) harmless_.insert(Lowered(name));
    NumberNodes();
    FindWhatMissingRoutinesSet();
    FindWhatRoutinesSet();
    FindAsynchronous();
    Start();
    while (!queue_.empty()) {
      const std::size_t node = queue_.front();
      queue_.pop_front();
      queued_[node] = false;
      Leave(node);
    }
    return Result();
  }

 private:
  // Nodes: the steps of all routines in order; after each routine one node, its exit.
  void NumberNodes() {
    for (const Routine& routine : program_.routines) {
      first_.push_back(routine_of_.size());
      routine_of_.insert(routine_of_.end(), routine.steps.size() + 1, first_.size() - 1);
      by_name_.try_emplace(routine.name, first_.size() - 1);
      auto& labels = labels_.emplace_back();
      for (std::size_t k = 0; k < routine.steps.size(); ++k) {
        const Step& step = routine.steps[k];
        if (step.kind == StepKind::kLabel) labels.try_emplace(step.label, first_.back() + k);
        if (step.kind == StepKind::kMotion) {
          motion_of_[first_.back() + k] = motions_.size();
          motions_.emplace_back(first_.back() + k);
        }
      }
    }
    State unreached;
    unreached.fill(kUnreached);
    states_.assign(routine_of_.size(), unreached);
    reached_.assign(routine_of_.size(), false);
    queued_.assign(routine_of_.size(), false);
    callers_.resize(program_.routines.size());
  }

  std::size_t ExitOf(std::size_t routine) const {
    return first_[routine] + program_.routines[routine].steps.size();
  }

  const Step* StepOf(std::size_t node) const {
    const std::size_t routine = routine_of_[node];
    return node == ExitOf(routine) ? nullptr
                                   : &program_.routines[routine].steps[node - first_[routine]];
  }

  static std::optional<std::size_t> SlotOf(StepKind kind) {
    switch (kind) {
      case StepKind::kSetTool:
        return 0;
      case StepKind::kSetBase:
        return 1;
      case StepKind::kSetLoad:
        return 2;
      case StepKind::kSetExtra:
        return 3;
      case StepKind::kShift:
        return 4;
      case StepKind::kObeyJoint:
        return 5;
      case StepKind::kObeyLinear:
        return 6;
      case StepKind::kMotion:
      case StepKind::kPostureLost:
        return kPrevious;
      default:
        return std::nullopt;
    }
  }

  const std::size_t* RoutineCalled(const Step& step) const {
    const auto at = by_name_.find(step.label);
    return at == by_name_.end() ? nullptr : &at->second;
  }

  static bool StartsRoutine(const Step& step) {
    return step.kind == StepKind::kCall || step.kind == StepKind::kStartThread ||
           step.kind == StepKind::kEnableInterrupt;
  }

  /// A call to a routine that is in none of the files, and that the user does not know to be
  /// harmless.
  bool CallsMissing(const Step& step) const {
    return RoutineCalled(step) == nullptr && !harmless_.contains(Lowered(step.label));
  }

  /// The slots that a routine which is in none of the files may change.
  void FindWhatMissingRoutinesSet() {
    for (const Routine& routine : program_.routines) {
      for (const Step& step : routine.steps) {
        if (const auto slot = SlotOf(step.kind)) ever_set_ |= 1U << *slot;
      }
    }
    missing_sets_ = ever_set_ | 1U << kPrevious;
    if (program_.points_state_frames) missing_sets_ &= ~(1U << 0 | 1U << 1);
  }

  /// The slots that each routine, or one that it calls, may change.
  void FindWhatRoutinesSet() {
    const std::size_t count = program_.routines.size();
    sets_.assign(count, 0);
    std::vector<std::vector<std::size_t>> callers(count);
    std::deque<std::size_t> changed;
    for (std::size_t r = 0; r < count; ++r) {
      for (const Step& step : program_.routines[r].steps) {
        if (const auto slot = SlotOf(step.kind)) sets_[r] |= 1U << *slot;
        if (step.kind != StepKind::kCall) continue;
        const std::size_t* const called = RoutineCalled(step);
        if (called != nullptr) {
          callers[*called].push_back(r);
        } else if (CallsMissing(step)) {
          sets_[r] |= missing_sets_;
        }
      }
      changed.push_back(r);
    }
    for (std::vector<std::size_t>& list : callers) {
      std::sort(list.begin(), list.end());
      list.erase(std::unique(list.begin(), list.end()), list.end());
    }
    while (!changed.empty()) {
      const std::size_t r = changed.front();
      changed.pop_front();
      for (const std::size_t caller : callers[r]) {
        const unsigned all = sets_[caller] | sets_[r];
        if (all == sets_[caller]) continue;
        sets_[caller] = all;
        changed.push_back(caller);
      }
    }
    called_.assign(count, false);
    for (std::size_t r = 0; r < count; ++r) {
      called_[r] = std::any_of(callers[r].begin(), callers[r].end(),
                               [r](std::size_t caller) { return caller != r; });
    }
  }

  /// Interrupts and threads, and the routines that run as a part of them.
  void FindAsynchronous() {
    const std::size_t count = program_.routines.size();
    is_handler_.assign(count, false);
    is_thread_.assign(count, false);
    in_handler_.assign(count, false);
    in_thread_.assign(count, false);
    State none;
    none.fill(kUnreached);
    handlers_left_ = handlers_enter_ = made_in_threads_ = made_outside_ = none;
    for (const Routine& routine : program_.routines) {
      for (const Step& step : routine.steps) {
        const bool thread = step.kind == StepKind::kStartThread;
        if (!thread && step.kind != StepKind::kEnableInterrupt) continue;
        if (const std::size_t* const started = RoutineCalled(step)) {
          called_[*started] = true;
          std::vector<bool>& known = thread ? is_thread_ : is_handler_;
          if (!known[*started]) (thread ? threads_ : handlers_).push_back(*started);
          known[*started] = true;
        } else if (CallsMissing(step)) {
          // Such a routine sets what is unknown then, like any missing routine: but at any time.
          for (std::size_t slot = 0; slot < kFacts; ++slot) {
            if ((missing_sets_ & (1U << slot)) == 0) continue;
            const int unknown = facts_.MissingChanges(slot, step);
            handlers_left_[slot] = facts_.Join(slot, handlers_left_[slot], unknown);
          }
        }
      }
    }
    for (const auto& [roots, inside] :
         {std::pair(&handlers_, &in_handler_), std::pair(&threads_, &in_thread_)}) {
      std::vector<std::size_t> open = *roots;
      while (!open.empty()) {
        const std::size_t r = open.back();
        open.pop_back();
        if ((*inside)[r]) continue;
        (*inside)[r] = true;
        for (const Step& step : program_.routines[r].steps) {
          if (step.kind != StepKind::kCall) continue;
          if (const std::size_t* const called = RoutineCalled(step)) open.push_back(*called);
        }
      }
    }
  }

  /// What interrupts and threads may have changed before a motion: an interrupt runs between two
  /// motions and is over then; a thread may have done any part of its work.
  int JoinBeside(std::size_t slot, std::size_t routine, int fact) {
    // What runs beside may stop a motion on its way: where the next one starts is then not known.
    const auto join = [&](int other) {
      const int joined = facts_.Join(slot, fact, other);
      if (slot != kPrevious || joined == fact || fact == kUnreached) return joined;
      return facts_.Unknown(facts_[joined].key, facts_[joined].place);
    };
    if (!in_handler_[routine]) fact = join(handlers_left_[slot]);
    if (!in_thread_[routine] || threads_.size() > 1) fact = join(made_in_threads_[slot]);
    if (in_thread_[routine]) fact = join(made_outside_[slot]);
    return fact;
  }

  /// Adds facts to what motions beside see, and visits these again if that is new.
  void Offer(State& pool, const State& facts, unsigned slots) {
    bool changed = false;
    for (std::size_t slot = 0; slot < kFacts; ++slot) {
      if ((slots & (1U << slot)) == 0) continue;
      const int joined = facts_.Join(slot, pool[slot], facts[slot]);
      changed = changed || joined != pool[slot];
      pool[slot] = joined;
    }
    if (!changed) return;
    for (const std::size_t node : motions_) {
      if (reached_[node]) Reach(node, states_[node]);
    }
  }

  void OfferToThreads(std::size_t routine, const State& facts, unsigned slots) {
    if (threads_.empty()) return;
    Offer(in_thread_[routine] ? made_in_threads_ : made_outside_, facts, slots);
  }

  /// An interrupt may come before this motion.
  void EnterHandlers(std::size_t node) {
    if (handlers_.empty() || in_handler_[routine_of_[node]]) return;
    bool changed = false;
    for (std::size_t slot = 0; slot < kFacts; ++slot) {
      const int joined = facts_.Join(slot, handlers_enter_[slot], states_[node][slot]);
      changed = changed || joined != handlers_enter_[slot];
      handlers_enter_[slot] = joined;
    }
    if (!changed) return;
    for (const std::size_t handler : handlers_) Reach(first_[handler], handlers_enter_);
  }

  void Start() {
    for (std::size_t r = 0; r < program_.routines.size(); ++r) {
      if (program_.routines[r].starts || !called_[r]) EnterStarted(r);
    }
    // Routines that only call each other are reached from nowhere: any of them may be started.
    while (true) {
      while (!queue_.empty()) {
        const std::size_t node = queue_.front();
        queue_.pop_front();
        queued_[node] = false;
        Leave(node);
      }
      std::size_t r = next_unstarted_;
      while (r < program_.routines.size() && reached_[first_[r]]) ++r;
      next_unstarted_ = r;
      if (r == program_.routines.size()) return;
      if (called_from_reached_.size() < program_.routines.size()) FindCalledFromReached();
      if (!called_from_reached_[r]) EnterStarted(r);
      ++next_unstarted_;
    }
  }

  /// A routine that only unreachable code of a reached routine calls stays unreached.
  void FindCalledFromReached() {
    called_from_reached_.assign(program_.routines.size(), false);
    for (std::size_t r = 0; r < program_.routines.size(); ++r) {
      if (!reached_[first_[r]]) continue;
      for (const Step& step : program_.routines[r].steps) {
        if (!StartsRoutine(step)) continue;
        if (const std::size_t* const called = RoutineCalled(step)) {
          called_from_reached_[*called] = true;
        }
      }
    }
  }

  void EnterStarted(std::size_t r) {
    const Routine& routine = program_.routines[r];
    State state;
    for (std::size_t slot = 0; slot < kFacts; ++slot) {
      const bool stated = slot < kStatedSlots && entry_.keys[slot].has_value();
      if (stated) {
        state[slot] = facts_.Known(slot, *entry_.keys[slot], routine.place);
      } else if (slot < kSlots && (slot >= kStatedSlots || (ever_set_ & (1U << slot)) == 0)) {
        state[slot] = facts_.Known(slot, "", routine.place);
      } else if (slot == kPrevious) {
        state[slot] = facts_.Previous(fmt::format("{} is started", StartedName(routine)),
                                      routine.place, {kAtStart});
      } else {
        state[slot] = facts_.Unknown(
            fmt::format("{}: not set before this line on every path, because {} may be started by "
                        "itself; --start {}={} states what holds there",
                        kSlotNames[slot], StartedName(routine), kEntryNames[slot],
                        slot == 4 ? "none" : "KEY"),
            routine.place);
      }
    }
    Reach(first_[r], state);
  }

  void Reach(std::size_t node, const State& incoming) {
    State& state = states_[node];
    bool changed = !reached_[node];
    reached_[node] = true;
    const bool beside = motion_of_.contains(node);
    for (std::size_t slot = 0; slot < kFacts; ++slot) {
      int joined = facts_.Join(slot, state[slot], incoming[slot]);
      if (beside) joined = JoinBeside(slot, routine_of_[node], joined);
      changed = changed || joined != state[slot];
      state[slot] = joined;
    }
    if (!changed || queued_[node]) return;
    queued_[node] = true;
    queue_.push_back(node);
  }

  /// The state after a call: what the routine may change as it leaves it, all else as before.
  void ReachAfterCall(std::size_t call, std::size_t routine) {
    const std::size_t exit = ExitOf(routine);
    if (!reached_[exit] || !reached_[call]) return;
    State after = states_[call];
    for (std::size_t slot = 0; slot < kFacts; ++slot) {
      if ((sets_[routine] & (1U << slot)) != 0) after[slot] = states_[exit][slot];
    }
    Reach(call + 1, after);
  }

  /// A fact that a node makes is made once, so that loops end.
  template <typename Make>
  int Made(std::size_t node, std::size_t slot, const Make& make) {
    const auto [at, added] = made_.try_emplace(node * kFacts + slot, kUnreached);
    if (added) at->second = make();
    return at->second;
  }

  void Leave(std::size_t node) {
    const std::size_t routine = routine_of_[node];
    const Step* const step = StepOf(node);
    if (step == nullptr) {
      for (const std::size_t call : callers_[routine]) ReachAfterCall(call, routine);
      if (is_handler_[routine]) Offer(handlers_left_, states_[node], sets_[routine]);
      return;
    }
    State after = states_[node];
    switch (step->kind) {
      case StepKind::kMotion:
        EnterHandlers(node);
        after[kPrevious] = Made(node, kPrevious, [&] { return PreviousAfter(node, *step); });
        OfferToThreads(routine, after, 1U << kPrevious);
        break;
      case StepKind::kPostureLost:
        after[kPrevious] = Made(node, kPrevious, [&] {
          return facts_.Unknown(
              fmt::format("{} at {}",
                          step->reason.empty() ? "the robot may be moved by others" : step->reason,
                          PlaceText(program_, step->place)),
              step->place);
        });
        OfferToThreads(routine, after, 1U << kPrevious);
        break;
      case StepKind::kStartThread:
        if (const std::size_t* const started = RoutineCalled(*step)) {
          Reach(first_[*started], after);
        }
        break;
      case StepKind::kReturn:
        Reach(ExitOf(routine), after);
        return;
      case StepKind::kJump:
      case StepKind::kBranch: {
        const auto label = labels_[routine].find(step->label);
        if (label != labels_[routine].end()) Reach(label->second, after);
        if (step->kind == StepKind::kJump && label != labels_[routine].end()) return;
        break;
      }
      case StepKind::kCall:
        if (const std::size_t* const called = RoutineCalled(*step)) {
          auto& calls = callers_[*called];
          if (!registered_.contains(node)) {
            registered_.emplace(node, true);
            calls.push_back(node);
          }
          Reach(first_[*called], after);
          ReachAfterCall(node, *called);
          return;
        }
        if (!CallsMissing(*step)) break;
        for (std::size_t slot = 0; slot < kFacts; ++slot) {
          if ((missing_sets_ & (1U << slot)) == 0) continue;
          after[slot] = Made(node, slot, [&] { return facts_.MissingChanges(slot, *step); });
        }
        OfferToThreads(routine, after, missing_sets_);
        break;
      default:
        if (const auto slot = SlotOf(step->kind)) {
          after[*slot] = Made(
              node, *slot, [&] { return facts_.FromSetting(*slot, step->setting, step->place); });
          OfferToThreads(routine, after, 1U << *slot);
        }
        break;
    }
    Reach(node + 1, after);
  }

  int PreviousAfter(std::size_t node, const Step& step) {
    const Motion& motion = step.motion;
    const std::string at = PlaceText(program_, step.place);
    if (!motion.special.empty()) {
      return facts_.Unknown(fmt::format("{} at {}", motion.special, at), step.place);
    }
    if (!motion.end.point || !motion.end.offset.unknown.empty()) {
      return facts_.Unknown(fmt::format("computed target at {}", at), step.place);
    }
    return facts_.Previous("", step.place, {static_cast<int>(motion_of_.at(node))});
  }

  SettingAt At(std::size_t slot, std::size_t node, const std::optional<Setting>& own,
               const Place& place) {
    const int number = own ? facts_.FromSetting(slot, *own, place) : states_[node][slot];
    if (number == kUnreached) return {"", place, "not reached"};
    const Fact& fact = facts_[number];
    return fact.known ? SettingAt{fact.key, fact.place, ""} : SettingAt{"", fact.place, fact.key};
  }

  Flow Result() {
    Flow flow;
    flow.uses.resize(program_.points.size());
    for (const std::size_t node : motions_) {
      const Step& step = *StepOf(node);
      MotionAt& at = flow.motions.emplace_back();
      at.motion = &step.motion;
      at.place = step.place;
      at.reached = reached_[node];
      const std::optional<Setting> none;
      at.settings = {At(0, node, step.motion.tool, step.place),
                     At(1, node, step.motion.base, step.place),
                     At(2, node, step.motion.load, step.place),
                     At(3, node, none, step.place),
                     At(4, node, none, step.place),
                     At(5, node, none, step.place),
                     At(6, node, none, step.place)};
      const int previous = states_[node][kPrevious];
      if (previous == kUnreached) {
        at.previous_unknown = "not reached";
      } else {
        const Fact& fact = facts_[previous];
        for (const int start : fact.starts) {
          if (start != kAtStart) at.starts.push_back(static_cast<std::size_t>(start));
        }
        at.at_start = at.starts.size() < fact.starts.size();
        if (fact.starts.size() == 1 && !at.at_start) {
          at.previous = at.starts.front();
        } else {
          at.previous_unknown = fact.key;
        }
      }
      const std::size_t index = flow.motions.size() - 1;
      const auto use = [&](const Target& target, PointUse::Role role) {
        if (!target.point || *target.point >= flow.uses.size()) return;
        flow.uses[*target.point].push_back({role, index, step.place, ""});
      };
      use(step.motion.end, PointUse::Role::kEnd);
      if (step.motion.via) use(*step.motion.via, PointUse::Role::kVia);
    }
    for (const Routine& routine : program_.routines) {
      for (const Step& step : routine.steps) {
        if (step.kind != StepKind::kUse || !step.point || *step.point >= flow.uses.size()) continue;
        flow.uses[*step.point].push_back({PointUse::Role::kOther, 0, step.place, step.reason});
      }
    }
    AddUsesOutside(flow);
    return flow;
  }

  /// Uses that files which were not given may make of a point.
  void AddUsesOutside(Flow& flow) const {
    if (entry_.complete) return;
    std::string missing = program_.has_main ? "" : "main";
    for (const Routine& routine : program_.routines) {
      for (const Step& step : routine.steps) {
        if (missing.empty() && StartsRoutine(step) && CallsMissing(step)) missing = step.label;
      }
    }
    for (std::size_t k = 0; k < program_.points.size(); ++k) {
      if (flow.uses[k].empty()) continue;
      const Point& point = program_.points[k];
      std::string reason;
      if (point.visible_to == Visibility::kController) {
        reason = "other programs of the controller may use it; --complete states that none does";
      } else if (point.visible_to == Visibility::kTask && !missing.empty()) {
        reason = fmt::format(
            "other modules may use it, because {} is in none of the files; give it, or --complete "
            "if no other module uses a point of these files",
            missing);
      }
      if (reason.empty()) continue;
      flow.uses[k].push_back({PointUse::Role::kOther, 0, point.place, std::move(reason)});
    }
  }

  const Program& program_;
  const EntryState& entry_;
  Facts facts_;
  std::vector<std::size_t> first_, routine_of_;
  std::unordered_map<std::string, std::size_t> by_name_;
  std::vector<std::unordered_map<std::string, std::size_t>> labels_;
  std::unordered_map<std::size_t, std::size_t> motion_of_;
  std::vector<std::size_t> motions_;  ///< nodes
  std::vector<unsigned> sets_;        ///< by routine
  unsigned ever_set_ = 0, missing_sets_ = 0;
  std::set<std::string> harmless_;
  std::vector<bool> is_handler_, is_thread_;
  std::vector<std::size_t> handlers_, threads_;  ///< routines of interrupts, of threads
  std::vector<bool> in_handler_, in_thread_;     ///< by routine: runs as a part of one
  State handlers_enter_{}, handlers_left_{};     ///< before and after any interrupt
  State made_in_threads_{}, made_outside_{};     ///< all facts that are made there
  std::vector<bool> called_, called_from_reached_;
  std::size_t next_unstarted_ = 0;
  std::vector<std::vector<std::size_t>> callers_;  ///< nodes of reached calls, by routine
  std::unordered_map<std::size_t, bool> registered_;
  std::unordered_map<std::size_t, int> made_;
  std::vector<State> states_;
  std::vector<bool> reached_, queued_;
  std::deque<std::size_t> queue_;
};

}  // namespace

Flow FlowOf(const Program& program, const EntryState& entry) {
  return Analysis(program, entry).Run();
}

}  // namespace plumbline::programs
