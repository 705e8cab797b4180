// A robot program as a filter sees it: its numbers and where they stand, and what its lines do.
//
// A brand's grammar turns files into a Program (app/programs/brands); everything after that is the
// same for all brands: which tool, base and load hold at each use of a point (app/programs/flow),
// the correction of the points and the bytes that change (app/programs/correction).
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "firmware-like/geometry/pose.h"

namespace plumbline::programs {

struct SourceFile {
  std::string name;   ///< as given, for messages
  std::string bytes;  ///< never decoded: spans refer to them
};

/// Bytes [begin, end) of a file.
struct Span {
  std::size_t file = 0;
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// For messages: `weld.src:41`. Lines count from 1; LF, CRLF and CR end a line.
struct Place {
  std::size_t file = 0;
  int line = 0;
};

/// A number as it is written, in the unit of the file.
struct Number {
  Span span;
  double value = 0;
};

/// What the file states about the posture of a point: `S 22, T 50`, `[0,-1,0,1]`, `'N U T, 0, 0,
/// 0'`. One field for each part that is written separately.
struct Configuration {
  struct Field {
    std::string key;   ///< of the brand: "S", "cf1", "CONFIG"
    Span span;         ///< of the value alone
    std::string text;  ///< the value as written
  };
  std::vector<Field> fields;  ///< empty: the posture is not stated
};

enum class PointKind {
  kPose,    ///< position and orientation
  kJoints,  ///< one value for each joint
};

/// Which programs can name a point, besides its own file.
enum class Visibility {
  kFiles,       ///< none that was not given
  kTask,        ///< what runs from Program::has_main: all that is given, if no routine is missing
  kController,  ///< any program of the controller
};

/// A point that is written out in a file: six or seven numbers that a motion can go to.
struct Point {
  std::string name;  ///< "XP1", "P[3]", "p20{2}", "tab[3,1]"; "" for a literal inside a motion
  Place place;
  PointKind kind = PointKind::kPose;
  /// A pose: x, y, z, then the orientation in the brand's order; joints: first joint first. An
  /// absent component is not written, and must not be added.
  std::vector<std::optional<Number>> numbers;
  Configuration configuration;
  std::vector<std::optional<Number>> external_axes;  ///< those in use, in the file's units
  /// Joints near which the posture is sought [rad] or [m], if the file states them besides the
  /// pose (`qnear` of URScript).
  std::vector<double> near_q;
  /// Key of the tool, base and load that the point itself states (UF and UT of FANUC); empty: none.
  std::string stated_tool, stated_base;
  /// Why it must stay as it is whatever its uses are: untaught, in a structure that the grammar
  /// does not follow; empty: it may be corrected.
  std::string untouchable;
  Visibility visible_to = Visibility::kFiles;
  /// Taught while the controller compensated its own model (status bit 4 of KUKA).
  bool absolutely_accurate = false;
};

/// Pose of a tool or base as the files declare it, and the load that comes with a tool.
struct LoadValue {
  std::optional<double> mass_kg;  ///< absent: the file says that it was not entered
  Vec3 cog_F = Vec3::Zero();      ///< centre of gravity in the flange frame [m]
  /// cog_F is given in the frame of the tool of the motion instead (payloads of ABB).
  bool cog_in_tool = false;
};
struct FrameValue {
  Place place;
  Pose X;  ///< of a tool in the flange frame, of a base in the robot's base frame [m]
  std::optional<LoadValue> load;  ///< of a tool: of its own body
  /// Why the value that is written is not the one in force: assigned at run time, moved by an
  /// external axis; empty: it is in force.
  std::string changes;
};

/// The value of a setting at a line: the key of a FrameValue or LoadValue, or why it is not known.
struct Setting {
  std::string key;      ///< "TOOL_DATA[3]", "tGripper", "UTOOL 2", text of a literal
  std::string unknown;  ///< not empty: why it cannot be known from the files

  bool operator==(const Setting&) const = default;
};

/// A constant pose between a point and where the motion goes: Offs and RelTool of ABB, pose_trans
/// of Universal Robots, Offset,PR[] of FANUC.
struct Offset {
  enum class In { kNone, kBase, kTool } in = In::kNone;
  Pose X;               ///< [m]
  std::string unknown;  ///< not empty: why it is not constant
};

/// Where a motion goes.
struct Target {
  std::optional<std::size_t> point;  ///< index in Program::points
  std::string computed;              ///< without a point: the expression, for the report
  std::string missing{};  ///< not empty: no file declares the point, and which file to give
  Offset offset{};
};

enum class MotionKind { kJoint, kLinear, kCircular, kSpline };

/// One motion. A setting that is absent is the one in force at the line.
struct Motion {
  MotionKind kind = MotionKind::kJoint;
  Target end;
  std::optional<Target> via;  ///< auxiliary point of a circle: only its position matters
  std::optional<Setting> tool, base, load;
  bool passes_by = false;  ///< approximated: the point itself is not reached
  /// Why the motion does not end at its target, or the target is no place to correct: search,
  /// stationary tool, relative motion, interpolation in joints; empty: an ordinary motion. Weaving
  /// and arc welding ride on the taught path, and are ordinary.
  std::string special;
  Span statement;  ///< the whole statement, after which further motions can be inserted
};

enum class StepKind {
  kMotion,
  kSetTool,
  kSetBase,
  kSetLoad,   ///< the whole load at the flange, in place of the tool's own
  kSetExtra,  ///< a load in addition: GripLoad
  kShift,     ///< from here on a displacement moves all targets, or a soft servo yields:
              ///< `setting.unknown` says which; empty: it has ended
  /// From here on, the controller does not obey the posture that a point of a joint motion, or of
  /// another one, states, and takes the nearest to where it comes from, if `setting.key` is "off"
  /// (ConfJ\Off and ConfL\Off of ABB); "": it obeys, as it does at first.
  kObeyJoint,
  kObeyLinear,
  kUse,  ///< a point is used other than as the target of a motion: `reason`
  kLabel,
  kJump,    ///< to `label`, always
  kBranch,  ///< to `label` or to the next step
  kCall,    ///< to the routine `label`, and back; it may be in none of the files
  kReturn,
  kPostureLost,      ///< where the robot is after this step is not known: a wait for a person
  kEnableInterrupt,  ///< the routine `label` may run between any two motions, which wait for it
  kStartThread,      ///< the routine `label` runs beside the following steps
};

/// One step of a routine, in the order in which it is executed.
struct Step {
  StepKind kind = StepKind::kMotion;
  Place place;
  Motion motion{};      ///< kMotion
  Setting setting{};    ///< kSetTool, kSetBase, kSetLoad, kSetExtra, kShift, kObey..
  std::string label{};  ///< kLabel, kJump, kBranch, kCall, kEnableInterrupt, kStartThread
  std::optional<std::size_t> point{};  ///< kUse
  std::string reason{};  ///< kUse: why this use forbids a correction; "" if it does not matter
};

/// A routine: DEF, PROC, a TP program, def. Loops and conditions are labels, jumps and branches.
struct Routine {
  std::string name;
  Place place;
  bool starts = false;  ///< may be started by the operator or the PLC: nothing is set before it
  std::vector<Step> steps;
};

/// A line that stays as it is, and why, apart from points: relative motions, unread instructions.
struct Remark {
  Place place;
  std::string text;
  /// The grammar could not parse it, so that what it does is not known.
  bool unread = false;
};

struct Program {
  std::vector<SourceFile> files;
  std::vector<Point> points;
  std::vector<Routine> routines;
  std::map<std::string, FrameValue> tools, bases;
  std::map<std::string, LoadValue> loads;
  std::vector<Remark> remarks;
  /// The files contain the one routine from which the controller starts all of them.
  bool has_main = false;
  /// Each point states its tool and base, and the controller refuses to go there in others: a
  /// routine that was not given changes them only to those.
  bool points_state_frames = false;
  /// Mark that an earlier correction left in a file, by index of the file; empty: none.
  std::vector<std::string> marks;
};

}  // namespace plumbline::programs
