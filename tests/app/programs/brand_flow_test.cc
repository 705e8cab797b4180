// What the grammars of the brands and the data flow find together: routines that were not given,
// interrupts and threads, points that other files can name.
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "app/programs/brands/fanuc.h"
#include "app/programs/brands/krl.h"
#include "app/programs/brands/rapid.h"
#include "app/programs/brands/urscript.h"
#include "app/programs/flow/flow.h"

namespace plumbline::brand_flow_test {

using namespace plumbline::programs;
using Catch::Contains;

namespace {

struct Analysed {
  Program program;
  Flow flow;

  const MotionAt& motion(std::size_t k) const { return flow.motions.at(k); }
  /// The key of a slot at motion k, or "?" and why it is not known.
  std::string At(std::size_t k, Slot slot) const {
    const SettingAt& setting = motion(k)[slot];
    return setting.known() ? setting.key : "?" + setting.unknown;
  }
  /// Why the uses of the first point with this name forbid a correction.
  std::string UsesOf(const std::string& name) const {
    for (std::size_t p = 0; p < program.points.size(); ++p) {
      if (program.points[p].name != name) continue;
      std::string reasons;
      for (const PointUse& use : flow.uses[p]) reasons += use.reason;
      return reasons;
    }
    FAIL("no point " << name);
    return "";
  }
};

Analysed Analyse(const Brand& brand, std::vector<SourceFile> files, const EntryState& entry = {}) {
  Analysed analysed{brand.Read(std::move(files)).program, {}};
  analysed.flow = FlowOf(analysed.program, entry);
  return analysed;
}

Analysed Ur(const std::string& body, const EntryState& entry = {}) {
  return Analyse(
      UniversalRobots(),
      {{"a.script",
        "def prog():\nset_tcp(p[0,0,0.4,0,0,0])\nset_payload(6.0,[0,0,0.4])\n" + body + "end\n"}},
      entry);
}

constexpr const char* kMoveUr = "movel(p[-0.8,-0.2,0.3,0,3.1415,0])\n";

Analysed Abb(const std::string& routines, const EntryState& entry = {}) {
  const std::string tail = ",[0,0,1,0],[0,-1,0,1],[9E9,9E9,9E9,9E9,9E9,9E9]];\n";
  return Analyse(
      Rapid(),
      {{"m.mod",
        "MODULE M\nPERS loaddata part:=[3,[0,0,50],[1,0,0,0],0,0,0];\n"
        "CONST robtarget p1:=[[600,0,800]" +
            tail + "PERS robtarget shared:=[[600,0,700]" + tail +
            "LOCAL CONST robtarget own:=[[600,0,700]" + tail + routines + "ENDMODULE\n"}},
      entry);
}

std::string Position(int number) {
  return "P[" + std::to_string(number) +
         "]{\n GP1:\n UF : 1, UT : 2, CONFIG : 'N U T, 0, 0, 0',\n X = 1200.000 mm, Y = 0.000 mm, "
         "Z = 500.000 mm,\n W = 180.000 deg, P = 0.000 deg, R = 0.000 deg\n};\n";
}

Analysed Fanuc(const std::string& statements, const EntryState& entry = {}) {
  return Analyse(FanucTp(),
                 {{"a.ls", "/PROG  A\n/ATTR\n/MN\n" + statements + "/POS\n" + Position(1) +
                               Position(2) + "/END\n"}},
                 entry);
}

constexpr const char* kFrames =
    "DEFDAT $CONFIG\nTOOL_DATA[1]={X 0,Y 0,Z 400,A 0,B 0,C 0}\n"
    "TOOL_DATA[2]={X 0,Y 0,Z 200,A 0,B 0,C 0}\nBASE_DATA[1]={X 100,Y 0,Z 0,A 0,B 0,C 0}\nENDDAT\n";

Analysed Kuka(const std::string& src, const std::string& dat = "DEFDAT WELD\nENDDAT\n",
              const EntryState& entry = {}) {
  return Analyse(KrlBrand(), {{"weld.src", src}, {"weld.dat", dat}, {"$config.dat", kFrames}},
                 entry);
}

constexpr const char* kMoveKrl = "LIN {X 800,Y 0,Z 300,A 0,B 0,C 180}\n";

EntryState Harmless(const std::string& name) {
  EntryState entry;
  entry.harmless = {name};
  return entry;
}

}  // namespace

TEST_CASE("URScript: a function that is none of the language and in no file may set another load") {
  const std::string body = "set_gripper_payload(3)\n" + std::string(kMoveUr);
  CHECK_THAT(Ur(body).At(0, Slot::kLoad), Contains("set_gripper_payload") &&
                                              Contains("--routine 'set_gripper_payload=harmless'"));
  const Analysed stated = Ur(body, Harmless("set_gripper_payload"));
  CHECK_THAT(stated.At(0, Slot::kLoad), Contains("6 kg"));
}

TEST_CASE("URScript: functions of the language leave tool, load and posture as they are") {
  const Analysed a = Ur(kMoveUr +
                        std::string("set_digital_out(1, True)\nx = get_tcp_force()\nsleep(0.1)\n"
                                    "socket_close()\n") +
                        kMoveUr);
  CHECK_THAT(a.At(1, Slot::kLoad), Contains("6 kg"));
  CHECK(a.motion(1).previous == 0U);
}

TEST_CASE("URScript: a thread that sets the load makes it unknown, however late") {
  const std::string main = "thread t():\n  set_payload(3.0,[0,0,0.4])\nend\nrun t()\n";
  const std::string set = "set_payload(6.0,[0,0,0.4])\n";
  CHECK_THAT(Ur(main + set + kMoveUr).At(0, Slot::kLoad), Contains("depending on the path"));
  const std::string watching = "thread t():\n  while True:\n    sync()\n  end\nend\nrun t()\n";
  CHECK_THAT(Ur(watching + kMoveUr).At(0, Slot::kLoad), Contains("6 kg"));
}

TEST_CASE("URScript: a thread moves with the settings that the program makes beside it") {
  const std::string thread = "thread t():\n  " + std::string(kMoveUr) + "end\nrun t()\n";
  CHECK_THAT(Ur(thread).At(0, Slot::kLoad), Contains("6 kg"));
  CHECK_THAT(Ur(thread + "set_payload(3.0,[0,0,0.4])\n").At(0, Slot::kLoad),
             Contains("depending on the path"));
}

TEST_CASE("URScript: a tool or load of which an element is assigned is not known") {
  CHECK_THAT(Ur("tcp = p[0,0,0.4,0,0,0]\ntcp[2] = 0.2\nset_tcp(tcp)\n" + std::string(kMoveUr))
                 .At(0, Slot::kTool),
             Contains("computed"));
  CHECK_THAT(Ur("cog = [0,0,0.4]\ncog[2] = 0.1\nset_payload(6, cog)\n" + std::string(kMoveUr))
                 .At(0, Slot::kLoad),
             Contains("computed"));
}

TEST_CASE("URScript: literals in lists and structures are named by where they are") {
  const Analysed a = Ur("cell = struct(pick=p[0.4,0,0.3,0,3,0], way=[p[0.5,0,0.3,0,3,0]])\n");
  REQUIRE(a.program.points.size() == 2);
  CHECK(a.program.points[0].name == "cell.pick");
  CHECK(a.program.points[1].name == "cell.way[0]");
}

TEST_CASE("RAPID: a routine that is not given may grip, if any line of the files grips") {
  const std::string main = "PROC main()\nOpenGripper;\nMoveL own,v100,fine,tool0;\n";
  CHECK(Abb(main + "ENDPROC\n").At(0, Slot::kExtra).empty());
  const std::string grips = main + "GripLoad part;\nENDPROC\n";
  CHECK_THAT(Abb(grips).At(0, Slot::kExtra), Contains("may be changed by OpenGripper"));
  CHECK_THAT(Abb(grips, Harmless("opengripper")).At(0, Slot::kExtra), !Contains("OpenGripper"));
}

TEST_CASE("RAPID: load0 is no load") {
  const Analysed a = Abb("PROC main()\nGripLoad load0;\nMoveL own,v100,fine,tool0;\nENDPROC\n");
  CHECK(a.motion(0)[Slot::kExtra].known());
  CHECK(a.At(0, Slot::kExtra).empty());
}

TEST_CASE("RAPID: a trap may come before each motion") {
  const std::string main =
      "PROC main()\nCONNECT i WITH moved;\nMoveL own,v100,fine,tool0;\nENDPROC\n";
  const std::string sets = "TRAP moved\nPDispSet d;\nENDTRAP\n",
                    prints = "TRAP moved\nTPWrite \"x\";\nENDTRAP\n";
  CHECK_THAT(Abb(main + sets).At(0, Slot::kShift), Contains("PDispSet"));
  CHECK(Abb(main + prints).motion(0)[Slot::kShift].known());
}

TEST_CASE("RAPID: the procedure of MoveLSync is executed at the end of its motion") {
  const Analysed a =
      Abb("PROC main()\nGripLoad load0;\nMoveLSync own,v100,z10,tool0,\"grip\";\n"
          "MoveL own,v100,fine,tool0;\nENDPROC\nPROC grip()\nGripLoad part;\nENDPROC\n");
  CHECK(a.At(0, Slot::kExtra).empty());
  CHECK(a.At(1, Slot::kExtra) == "part");
}

TEST_CASE("RAPID: a soft servo lasts until it is switched off") {
  const Analysed a =
      Abb("PROC main()\nMoveL own,v100,fine,tool0;\nSoftAct 3,20;\nMoveL own,v100,fine,tool0;\n"
          "SoftDeact;\nMoveL own,v100,fine,tool0;\nENDPROC\n");
  CHECK(a.motion(0)[Slot::kShift].known());
  CHECK_THAT(a.At(1, Slot::kShift), Contains("soft servo"));
  CHECK(a.motion(2)[Slot::kShift].known());
}

TEST_CASE("RAPID: weaving rides on the taught path") {
  const Analysed a = Abb("PROC main()\nArcL own,v100,sm,wd\\Weave:=wv,fine,tool0;\nENDPROC\n");
  CHECK(a.motion(0).motion->special.empty());
}

TEST_CASE("RAPID: other modules can use a global point, unless main and all it calls are given") {
  const std::string moves = "MoveL p1,v100,fine,tool0;\nENDPROC\n";
  CHECK_THAT(Abb("PROC weld()\n" + moves).UsesOf("p1"), Contains("main") && Contains("--complete"));
  CHECK_THAT(Abb("PROC main()\nGrip;\n" + moves).UsesOf("p1"), Contains("Grip"));
  CHECK(Abb("PROC main()\n" + moves).UsesOf("p1").empty());
  CHECK(Abb("PROC weld()\n" + moves).UsesOf("own").empty());
  EntryState complete;
  complete.complete = true;
  CHECK(Abb("PROC weld()\n" + moves, complete).UsesOf("p1").empty());
}

TEST_CASE("RAPID: another task can use a persistent point") {
  const std::string main = "PROC main()\nMoveL shared,v100,fine,tool0;\nENDPROC\n";
  CHECK_THAT(Abb(main).UsesOf("shared"), Contains("other programs"));
}

TEST_CASE("FANUC: a macro that is not given may change the payload, not the tool of a point") {
  const std::string start = "   1:  UFRAME_NUM=1 ;\n   2:  UTOOL_NUM=2 ;\n",
                    moves = "   4:  OPEN HAND 1 ;\n   5:L P[1] 100mm/sec FINE    ;\n";
  const Analysed no_load = Fanuc(start + moves);
  CHECK(no_load.At(0, Slot::kLoad).empty());
  CHECK(no_load.At(0, Slot::kTool) == "UTOOL 2");
  CHECK_FALSE(no_load.motion(0).previous);
  const std::string loaded = start + "   3:  PAYLOAD[1] ;\n" + moves;
  CHECK_THAT(Fanuc(loaded).At(0, Slot::kLoad), Contains("may be changed by OPEN HAND 1"));
  CHECK(Fanuc(loaded, Harmless("Open hand 1")).At(0, Slot::kLoad) == "PAYLOAD 1");
}

TEST_CASE("FANUC: joints that yield move the robot off its targets, weaving does not") {
  const Analysed a = Fanuc(
      "   1:  SOFTFLOAT[1] ;\n   2:L P[1] 100mm/sec FINE    ;\n   3:  SOFTFLOAT END ;\n"
      "   4:  Weave Sine[1] ;\n   5:L P[2] 100mm/sec FINE    ;\n");
  CHECK_THAT(a.At(0, Slot::kShift), Contains("SOFTFLOAT"));
  CHECK(a.motion(1)[Slot::kShift].known());
  CHECK(a.motion(1).motion->special.empty());
}

TEST_CASE("KRL: a routine that is not given may set another tool, and no load if no line does") {
  const std::string src = "DEF WELD( )\n$TOOL=TOOL_DATA[1]\n$BASE=$NULLFRAME\nGRIP( )\n" +
                          std::string(kMoveKrl) + "END\n";
  CHECK_THAT(Kuka(src).At(0, Slot::kTool), Contains("may be changed by GRIP"));
  CHECK(Kuka(src).At(0, Slot::kLoad).empty());
  CHECK(Kuka(src, "DEFDAT WELD\nENDDAT\n", Harmless("grip")).At(0, Slot::kTool) == "TOOL_DATA[1]");
}

TEST_CASE("KRL: an interrupt may set another tool before each motion, also one that is not given") {
  const std::string begin = "DEF WELD( )\n$TOOL=TOOL_DATA[1]\n$BASE=$NULLFRAME\n",
                    end = std::string(kMoveKrl) + "END\n",
                    handler = "DEF AWAY( )\n$TOOL=TOOL_DATA[2]\nEND\n";
  const std::string declares = "INTERRUPT DECL 5 WHEN $IN[1] DO AWAY( )\n";
  CHECK_THAT(Kuka(begin + declares + end + handler).At(0, Slot::kTool),
             Contains("depending on the path"));
  CHECK_THAT(Kuka(begin + declares + end).At(0, Slot::kTool), Contains("may be changed by AWAY"));
  const std::string trigger = "TRIGGER WHEN DISTANCE=1 DELAY=0 DO AWAY( ) PRIO=-1\n";
  CHECK_THAT(Kuka(begin + trigger + end + handler).At(0, Slot::kTool),
             Contains("depending on the path"));
}

TEST_CASE("KRL: a frame that a literal is assigned to has two values, unless it is its only one") {
  const std::string begin = "DEF WELD( )\n$TOOL=TOOL_DATA[1]\n",
                    end = std::string(kMoveKrl) + "END\n",
                    literal = "={X 300,Y 0,Z 0,A 0,B 0,C 0}\n";
  CHECK_THAT(Kuka(begin + "F" + literal + "$BASE=F\n" + end,
                  "DEFDAT WELD\nDECL FRAME F={X 0,Y 0,Z 0,A 0,B 0,C 0}\nENDDAT\n")
                 .At(0, Slot::kBase),
             Contains("F is assigned while the program runs, at weld.src:3"));
  CHECK_THAT(Kuka(begin + "BASE_DATA[1]" + literal +
                  "$BASE=BASE_DATA[1]:{X 0,Y 0,Z 0,A 0,B 0,C 0}\n" + end)
                 .At(0, Slot::kBase),
             Contains("BASE_DATA[1] is assigned"));
  CHECK(Kuka("DEF WELD( )\nDECL FRAME F\n$TOOL=TOOL_DATA[1]\nF" + literal + "$BASE=F\n" + end)
            .At(0, Slot::kBase) == "F");
}

TEST_CASE("KRL: a soft servo lasts until it is switched off") {
  const std::string begin = "DEF WELD( )\n$TOOL=TOOL_DATA[1]\n$BASE=$NULLFRAME\n";
  const Analysed a = Kuka(begin + "SET_TORQUE_LIMITS(1,limits)\n" + kMoveKrl +
                          "RESET_TORQUE_LIMITS(1)\n" + kMoveKrl + "$TORQUE_AXIS=2\n" + kMoveKrl +
                          "$TORQUE_AXIS='B000000'\n" + kMoveKrl + "END\n");
  CHECK_THAT(a.At(0, Slot::kShift), Contains("soft servo"));
  CHECK(a.motion(1)[Slot::kShift].known());
  CHECK_THAT(a.At(2, Slot::kShift), Contains("soft servo"));
  CHECK(a.motion(3)[Slot::kShift].known());
}

TEST_CASE("KRL: other programs can use a public point") {
  const std::string src = "DEF WELD( )\nLIN XP1\nEND\n",
                    dat =
                        "DEFDAT WELD PUBLIC\nDECL E6POS XP1={X 800,Y 0,Z 300,A 0,B 0,C 180,S 2,"
                        "T 35}\nENDDAT\n";
  CHECK_THAT(Kuka(src, dat).UsesOf("XP1"), Contains("other programs") && Contains("--complete"));
  EntryState complete;
  complete.complete = true;
  CHECK(Kuka(src, dat, complete).UsesOf("XP1").empty());
}

}  // namespace plumbline::brand_flow_test
