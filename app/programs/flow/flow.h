// Data flow through a program: the tool, base, load and previous motion that hold at each motion.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "app/programs/program.h"

namespace plumbline::programs {

/// What a step of a program can set, and a motion depends on.
enum class Slot { kTool, kBase, kLoad, kExtra, kShift, kObeyJoint, kObeyLinear };
inline constexpr std::size_t kSlots = 7;
inline constexpr std::size_t kStatedSlots = 5;  // those that a user can state, the first ones

/// A setting at one line: the key of its value and the line that sets it, or why it is not known.
struct SettingAt {
  std::string key;  ///< empty: the program never sets it
  Place place;
  std::string unknown;  ///< not empty: why the value is not known, with lines

  bool known() const { return unknown.empty(); }
};

/// One motion with everything that holds where it is executed.
struct MotionAt {
  const Motion* motion = nullptr;
  Place place;
  std::array<SettingAt, kSlots> settings;
  /// The motions after which this one may start, as indices in Flow::motions; with `at_start` also
  /// where the program is started. Neither: not known.
  std::vector<std::size_t> starts;
  bool at_start = false;
  std::optional<std::size_t> previous;  ///< the only one of them
  std::string previous_unknown;         ///< why not
  bool reached = true;                  ///< false: no path through the files leads here

  const SettingAt& operator[](Slot slot) const { return settings[static_cast<std::size_t>(slot)]; }
};

/// A use of a point: as the end or auxiliary point of a motion, or otherwise.
struct PointUse {
  enum class Role { kEnd, kVia, kOther } role = Role::kOther;
  std::size_t motion = 0;  ///< index in Flow::motions, for kEnd and kVia
  Place place;
  std::string reason;  ///< of kOther: why it forbids a correction; empty if it does not
};

struct Flow {
  std::vector<MotionAt> motions;            ///< in the order of the routines and their steps
  std::vector<std::vector<PointUse>> uses;  ///< of each point
};

/// What the user states about what the files do not contain.
struct EntryState {
  /// What holds where a program is started; "" is: nothing set.
  std::array<std::optional<std::string>, kStatedSlots> keys;
  /// Routines that are in none of the files, move nothing and set nothing; in any case of letters.
  std::vector<std::string> harmless;
  bool complete = false;  ///< no other file uses a point of these files
};

/// Finds what holds at every motion, for all paths through the program.
///
/// Each setting is a flat lattice: unreached, known by value, unknown with a reason. Paths that
/// meet with different values make a conflict that names both lines; keys with equal values agree.
/// A routine is analysed once, for all its callers together; after a call, what the routine cannot
/// change keeps its value from before the call. A routine that may be started, or that nobody
/// calls, starts with nothing known, except settings that no line of the program ever makes (their
/// key is then empty) and those of `entry`.
///
/// A routine that is in none of the files and is not stated to be harmless may move the robot, and
/// change whatever some line of the files sets (but see Program::points_state_frames). An interrupt
/// may come before each motion outside of interrupts; a thread may have done any part of its work.
/// A point that files outside can name has a use there, unless they cannot run (Visibility) or the
/// user states that there are none. Time is proportional to the number of steps.
Flow FlowOf(const Program& program, const EntryState& entry = {});

/// "weld.src:41".
std::string PlaceText(const Program& program, const Place& place);

}  // namespace plumbline::programs
