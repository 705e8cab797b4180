// URScript: points with their places, settings, features, offsets and the order of the motions.
#include "app/programs/brands/urscript.h"

#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <numbers>
#include <string>

#include "firmware-like/geometry/rotation.h"

namespace plumbline::programs::urscript {
namespace {

Program Read(const std::string& text) {
  return UniversalRobots().Read({{"weld.script", text}}).program;
}

const Point& Named(const Program& program, const std::string& name) {
  for (const Point& point : program.points) {
    if (point.name == name) return point;
  }
  FAIL("no point " << name);
  std::abort();
}

/// Reasons why the uses of a point forbid its correction.
std::string UsesOf(const Program& program, const std::string& name) {
  std::string reasons;
  for (const Routine& routine : program.routines) {
    for (const Step& step : routine.steps) {
      if (step.kind != StepKind::kUse || program.points[*step.point].name != name) continue;
      reasons += fmt::format("{}: {};", step.place.line, step.reason);
    }
  }
  return reasons;
}

std::vector<const Motion*> MotionsOf(const Program& program) {
  std::vector<const Motion*> motions;
  for (const Routine& routine : program.routines) {
    for (const Step& step : routine.steps) {
      if (step.kind == StepKind::kMotion) motions.push_back(&step.motion);
    }
  }
  return motions;
}

std::string TargetName(const Program& program, const Target& target) {
  return target.point ? program.points[*target.point].name : "(" + target.computed + ")";
}

std::string TargetsOf(const Program& program) {
  std::string names;
  for (const Motion* motion : MotionsOf(program)) {
    names += (names.empty() ? "" : " ") + TargetName(program, motion->end);
  }
  return names;
}

/// The steps of a routine as a line of text.
std::string StepsOf(const Program& program, const std::string& name) {
  std::string text;
  for (const Routine& routine : program.routines) {
    if (routine.name != name) continue;
    for (const Step& step : routine.steps) {
      text += text.empty() ? "" : " ";
      switch (step.kind) {
        case StepKind::kMotion:
          text += TargetName(program, step.motion.end);
          break;
        case StepKind::kSetTool:
          text += "tool=" + step.setting.key;
          break;
        case StepKind::kSetLoad:
          text += "load=" + step.setting.key;
          break;
        case StepKind::kShift:
          text += step.setting.unknown.empty() ? "unshift" : "shift";
          break;
        case StepKind::kUse:
          text += "use";
          break;
        case StepKind::kLabel:
          text += step.label + ":";
          break;
        case StepKind::kJump:
          text += ">" + step.label;
          break;
        case StepKind::kBranch:
          text += "?" + step.label;
          break;
        case StepKind::kCall:
          text += step.label + "()";
          break;
        case StepKind::kReturn:
          text += "return";
          break;
        case StepKind::kPostureLost:
          text += "lost";
          break;
        default:
          text += "other";
          break;
      }
    }
  }
  return text;
}

std::string NumbersIn(const std::string& text, const Point& point) {
  std::string numbers;
  for (const std::optional<Number>& number : point.numbers) {
    numbers += text.substr(number->span.begin, number->span.end - number->span.begin) + " ";
  }
  return numbers;
}

constexpr char kGenerated[] =
    "def weld():\r\n"
    "  set_tcp(p[0.0,0.0,0.22,0.0,0.0,0.0])\r\n"
    "  set_target_payload(1.230000, [0.002000, 0.002000, 0.042000], [0.002174, 0, 0, 0, 0, 0])\n"
    "  global W_p=p[.350518879840, -.427, 1.2975335506409602E-10, 0, -3.1, 0.01]\n"
    "  global W_q=[1.68, -1.90, 1.57, 0.40, 1.67, 0.02]\n"
    "  $ 1 \"p[1,2,3,4,5,6]\" \"breakAfter\"\n"
    "  movej(get_inverse_kin(W_p, qnear=W_q), a=1.39, v=1.04) # movel(W_p)\n"
    "  movel(W_p, a=1.2, v=0.25, r=0.01)\n"
    "  textmsg(\"movel(p[1,2,3,4,5,6])\")\n"
    "end\n";

TEST_CASE("a generated script: pose, tool, load, joints to start from and approximation") {
  const Program program = Read(kGenerated);
  REQUIRE(program.points.size() == 1);
  const Point& point = program.points[0];
  CHECK(point.name == "W_p");
  CHECK(point.place.line == 4);
  CHECK(NumbersIn(kGenerated, point) == ".350518879840 -.427 1.2975335506409602E-10 0 -3.1 0.01 ");
  CHECK(point.numbers[4]->value == -3.1);
  CHECK(point.near_q == std::vector<double>{1.68, -1.90, 1.57, 0.40, 1.67, 0.02});
  CHECK(StepsOf(program, "weld") ==
        "tool=p[0.0,0.0,0.22,0.0,0.0,0.0] load=1.23 kg at [0.002, 0.002, 0.042] m W_p W_p");
  CHECK(program.tools.at("p[0.0,0.0,0.22,0.0,0.0,0.0]").X.p.z() == 0.22);
  CHECK(program.loads.at("1.23 kg at [0.002, 0.002, 0.042] m").mass_kg == 1.23);
  const std::vector<const Motion*> motions = MotionsOf(program);
  CHECK(motions[0]->kind == MotionKind::kJoint);
  CHECK_FALSE(motions[0]->passes_by);
  CHECK(motions[1]->kind == MotionKind::kLinear);
  CHECK(motions[1]->passes_by);
  CHECK(UsesOf(program, "W_p").empty());
  REQUIRE(program.remarks.size() == 1);
  CHECK(program.remarks[0].place.line == 6);
  CHECK(program.remarks[0].text.find(".urp, which still has the old points") != std::string::npos);
}

TEST_CASE("only the joints count for a motion to joints") {
  const Program program = Read(
      "def a():\n global W_p=p[.1,.2,.3,0,3,0]\n global W_q=[1,-1,1,0,1,0]\n movej(W_q)\nend\n");
  REQUIRE(MotionsOf(program).size() == 1);
  CHECK(TargetsOf(program) == "W_q");
  CHECK(Named(program, "W_q").kind == PointKind::kJoints);
  CHECK(Named(program, "W_p").numbers.size() == 6);
}

TEST_CASE("the joints that PolyScope wrote with a waypoint tell its posture") {
  const Program program = Read(
      "def a():\n global W_p=p[.1,.2,.3,0,3,0]\n global W_q=[1,-1,1,0,1,0]\n movel(W_p)\nend\n");
  CHECK(Named(program, "W_p").near_q == std::vector<double>{1, -1, 1, 0, 1, 0});
}

TEST_CASE("a circle has an auxiliary point") {
  const Program program =
      Read("def a():\n movec(p[.1,.2,.3,0,3,0], pose_to=p[.4,.2,.3,0,3,0], a=1, v=1, r=0)\nend\n");
  const std::vector<const Motion*> motions = MotionsOf(program);
  REQUIRE(motions.size() == 1);
  CHECK(motions[0]->kind == MotionKind::kCircular);
  REQUIRE(motions[0]->via);
  CHECK(program.points[*motions[0]->via->point].numbers[0]->value == 0.1);
  CHECK(program.points[*motions[0]->end.point].numbers[0]->value == 0.4);
}

TEST_CASE("a pose in a feature keeps the feature and is corrected in it") {
  const Program program = Read(
      "def a():\n plane=p[1,2,3,0,0,1.5707963267948966]\n"
      " movel(pose_trans(plane, p[.1,.2,.3,0,3,0]))\nend\n");
  const std::vector<const Motion*> motions = MotionsOf(program);
  REQUIRE(motions.size() == 1);
  CHECK(motions[0]->base->key == "plane");
  CHECK(program.bases.at("plane").X.p == Vec3(1, 2, 3));
  CHECK(motions[0]->end.offset.in == Offset::In::kNone);
  CHECK(program.points[*motions[0]->end.point].numbers[0]->value == 0.1);
  CHECK(UsesOf(program, "plane") == "3: is the frame of other points (pose_trans);");
}

TEST_CASE(
    "a constant pose behind a point is an offset in the tool, in front of it one in the base") {
  const Program program = Read(
      "def a():\n W=p[.1,.2,.3,0,3,0]\n movel(W)\n movel(pose_trans(W, p[0,0,-0.05,0,0,0]))\n"
      " movel(pose_trans(p[0,0,0.05,0,0,0], W))\n movel(pose_add(W, p[0,0,0.1,0,0,0]))\nend\n");
  const std::vector<const Motion*> motions = MotionsOf(program);
  REQUIRE(motions.size() == 4);
  CHECK(TargetsOf(program) == "W W W W");
  CHECK(motions[1]->end.offset.in == Offset::In::kTool);
  CHECK(motions[1]->end.offset.X.p.z() == -0.05);
  CHECK(motions[2]->end.offset.in == Offset::In::kBase);
  CHECK(motions[3]->end.offset.in == Offset::In::kBase);
  CHECK(motions[3]->end.offset.X.p.z() == 0.1);
  CHECK(program.points.size() == 1);
  CHECK(UsesOf(program, "W").empty());
}

TEST_CASE("points of a relative motion count only by their difference") {
  const Program program = Read(
      "def a():\n global R_from_p=p[.1,.2,.3,0,3,0]\n global R_to_p=p[.1,.2,.4,0,3,0]\n"
      " movel(pose_add(get_target_tcp_pose(), pose_sub(R_to_p, R_from_p)), a=1.2, v=0.25)\nend\n");
  CHECK(TargetsOf(program) == "(pose_add(get_target_tcp_pose(), pose_sub(R_to_p, R_from_p)))");
  for (const char* const name : {"R_from_p", "R_to_p"}) {
    CHECK(UsesOf(program, name) ==
          "4: counts only by its difference from another pose (pose_sub);");
  }
}

TEST_CASE("tables of poses: an index that changes reaches each of them") {
  const std::string table =
      "def a():\n tab=[p[.1,.2,.3,0,3,0],p[.2,.2,.3,0,3,0]]\n i=0\n while i<2:\n";
  const Program any = Read(table + "  movel(tab[i])\n  i=i+1\n end\nend\n");
  CHECK(TargetsOf(any) == "tab[0] tab[1]");
  CHECK(StepsOf(any, "a") == "1: ?2 ?4 tab[0] >3 4: tab[1] 3: >1 2:");
  const Program second = Read(table + " end\n movel(tab[1])\nend\n");
  CHECK(TargetsOf(second) == "tab[1]");
  const Program filled =
      Read(table + "  tab[i]=get_actual_tcp_pose()\n movel(tab[0])\n end\nend\n");
  CHECK(UsesOf(filled, "tab[0]") == "2: is overwritten in line 5;");
}

TEST_CASE("a variable with several values is followed line by line, and by branches") {
  const Program lines =
      Read("def a():\n t=p[.1,.2,.3,0,3,0]\n movel(t)\n t=p[.2,.2,.3,0,3,0]\n movel(t)\nend\n");
  REQUIRE(MotionsOf(lines).size() == 2);
  CHECK(lines.points[*MotionsOf(lines)[0]->end.point].place.line == 2);
  CHECK(lines.points[*MotionsOf(lines)[1]->end.point].place.line == 4);
  const Program branches = Read(
      "def a():\n if b:\n t=p[.1,.2,.3,0,3,0]\n else:\n t=p[.2,.2,.3,0,3,0]\n end\n "
      "movel(t)\nend\n");
  CHECK(MotionsOf(branches).size() == 2);
  const Program sensed =
      Read("def a():\n t=p[.1,.2,.3,0,3,0]\n t=get_actual_tcp_pose()\n movel(t)\nend\n");
  CHECK(TargetsOf(sensed) == "(t)");
}

TEST_CASE("a parameter stands for the arguments of the calls") {
  const Program program = Read(
      "def go(to, speed=0.1):\n movel(to, v=speed)\nend\n"
      "def main():\n go(p[.1,.2,.3,0,3,0])\n go(speed=1, to=p[.2,.2,.3,0,3,0])\nend\nmain()\n");
  CHECK(MotionsOf(program).size() == 2);
  CHECK(StepsOf(program, "main") == "go() go()");
  for (const Routine& routine : program.routines) {
    if (routine.name == "go") CHECK_FALSE(routine.starts);
  }
}

TEST_CASE("blocks end with end, whatever their indentation") {
  const Program program = Read(
      "def a():\nif x == 1:\nmovel(p[.1,0,0,0,3,0])\nelif (not y):\nmovel(p[.2,0,0,0,3,0])\n"
      "else:\nreturn False\nend\nwhile True:\nif z: break "
      "end\nmovel(p[.3,0,0,0,3,0])\nend\nhalt\nend\n");
  CHECK(StepsOf(program, "a") == "?1  >2 1: ?3  >2 3: return 2: 4: ?6 >5 6: 7:  >4 5: 8: >8");
}

TEST_CASE("force control and conveyors shift the targets, jogging loses the posture") {
  CHECK(StepsOf(Read("def a():\n force_mode(p[0,0,0,0,0,0],[0,0,1,0,0,0],[0,0,9,0,0,0],2,[1,1,1,1,"
                     "1,1])\n W=p[.1,0,0,0,3,0]\n movel(W)\n end_force_mode()\n movel(W)\n"
                     " speedl([0,0,0.1,0,0,0],1,1)\n get_actual_tcp_pose()\n unheard_of()\nend\n"),
                "a") == "shift lost W unshift lost W lost unheard_of()");
}

TEST_CASE("settings that depend on the run are unknown, with the reason") {
  const Program program = Read(
      "def a():\n set_tcp(get_tcp_offset())\n set_payload(0.1)\n set_payload(m, [0,0,0])\nend\n");
  std::string reasons;
  for (const Step& step : program.routines[1].steps) reasons += step.setting.unknown + "; ";
  CHECK(reasons ==
        "set_tcp(get_tcp_offset()) is computed; ; set_payload() has computed arguments; ");
}

TEST_CASE("a load without a centre of gravity is one that was not entered") {
  const Program program = Read("def a():\n set_payload(0.1)\nend\n");
  CHECK(StepsOf(program, "a") == "load=set_payload(0.1)");
  CHECK_FALSE(program.loads.at("set_payload(0.1)").mass_kg);
}

TEST_CASE("a line that is not understood keeps its poses as they are, and only its own") {
  const Program program =
      Read("def a():\n W=p[.1,0,0,0,3,0]\n movel(W\n movel(W) ? p[.2,0,0,0,3,0]\n movel(W)\nend\n");
  CHECK(program.remarks.size() == 1);
  bool listed = false;
  for (const Point& point : program.points) listed |= point.numbers[0]->value == 0.2;
  CHECK(listed);
}

TEST_CASE("the same rotation is written as the vector nearest to the old one") {
  const Conventions& conventions = UniversalRobots().conventions();
  for (const Vec3& old : {Vec3(0, 3.13, 0.1), Vec3(0, -3.2, 0.1), Vec3(4, 4, 0), Vec3(0, 0, 0),
                          Vec3(0, 0, 2 * std::numbers::pi), Vec3(1e-7, 0, 0)}) {
    const Mat3 R = RotationFromVector(old) * RotationFromVector({1e-4, -2e-4, 1e-4});
    const std::vector<double> numbers =
        conventions.numbers(R, std::vector{old.x(), old.y(), old.z()});
    const Vec3 found(numbers[0], numbers[1], numbers[2]);
    CHECK((RotationFromVector(found) - R).norm() < 1e-12);
    if (old.norm() < 6) CHECK((found - old).norm() < 5e-3);
  }
}

TEST_CASE("a PolyScope program is refused and says that the robot runs it") {
  const Reading reading = UniversalRobots().Read(
      {{"weld.script", kGenerated}, {"weld.urp", std::string("\x1f\x8b\x08\0", 4)}});
  REQUIRE(reading.refusals.size() == 1);
  CHECK(reading.refusals[0].file == 1);
  CHECK(reading.refusals[0].what.find("still has the old points") != std::string::npos);
  CHECK(reading.program.points.size() == 1);
}

TEST_CASE("a mark is found again") {
  SourceFile file{"weld.script", kGenerated};
  const auto insertion = UniversalRobots().Mark(file, "plumbline program 1234");
  REQUIRE(insertion);
  CHECK(insertion->text == "# plumbline program 1234\r\n");
  file.bytes.insert(insertion->at, insertion->text);
  CHECK(UniversalRobots().Read({file}).program.marks[0] == "plumbline program 1234");
}

TEST_CASE("the head of a routine that cannot be parsed is a remark with its line") {
  const Program program = Read("x = 1\ndef a(:\n movel(p[1,2\n");
  REQUIRE_FALSE(program.remarks.empty());
  CHECK(program.remarks[0].place.line == 2);
  CHECK(program.remarks[0].unread);
}

TEST_CASE("a block without its end, and an end without a block, are remarks with their lines") {
  const Program open = Read("def weld():\n  if (a > 1):\n    movej([0, 0, 0, 0, 0, 0])\nend\n");
  REQUIRE(open.remarks.size() == 1);
  CHECK(open.remarks[0].place.line == 1);
  CHECK(open.remarks[0].text == "the `end` of this block is missing");
  CHECK(open.remarks[0].unread);
  const Program closed = Read("def weld():\n  movej([0, 0, 0, 0, 0, 0])\nend\nend\n");
  REQUIRE(closed.remarks.size() == 1);
  CHECK(closed.remarks[0].place.line == 4);
  CHECK(closed.remarks[0].text == "this `end` ends no block");
}

TEST_CASE("points are inserted in the style of the motion, in its feature") {
  const std::vector<double> numbers = {.1, .2, .3, 0, 3, 0};
  const Program program = Read(
      "def a():\n  W=p[.1,.2,.3,0,3,0]\n  movel(W, a=1.2, v=0.25, r=0.01)\n"
      "  movel(pose_trans(F, p[.1,.2,.3,0,3,0]), v=1)\nend\nglobal F=p[1,0,0,0,0,0]\n");
  const std::vector<const Motion*> motions = MotionsOf(program);
  REQUIRE(motions.size() == 2);
  const std::string pose =
      "p[0.100000000, 0.200000000, 0.300000000, 0.000000000, 3.000000000, 0.000000000]";
  CHECK(UniversalRobots().InsertedMotion(program, *motions[0], numbers, 0.1) ==
        "movel(" + pose + ", a=1.2, v=0.25, r=0.01)\n  ");
  CHECK(UniversalRobots().InsertedMotion(program, *motions[1], numbers, 0.1) ==
        "movel(pose_trans(F, " + pose + "), v=1)\n  ");
  // A blend radius fits into the part.
  CHECK(UniversalRobots().InsertedMotion(program, *motions[0], numbers, 0.01) ==
        "movel(" + pose + ", a=1.2, v=0.25, r=0.00400)\n  ");
}

}  // namespace
}  // namespace plumbline::programs::urscript
