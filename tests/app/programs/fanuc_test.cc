#include "app/programs/brands/fanuc.h"

#include <catch2/catch.hpp>
#include <set>

#include "app/programs/brands/fanuc_posture.h"

namespace plumbline::fanuc_test {

using namespace plumbline::programs;

std::string Listing(const std::string& statements, const std::string& positions = "",
                    const std::string& name = "WELD") {
  return "/PROG  " + name +
         "\n/ATTR\nOWNER\t\t= MNEDITOR;\nCOMMENT\t\t= \"\";\nLINE_COUNT\t= 3;\n"
         "DEFAULT_GROUP\t= 1,*,*,*,*;\n/APPL\n/MN\n" +
         statements + "/POS\n" + positions + "/END\n";
}

std::string Pose(int number, const std::string& frames = "UF : 1, UT : 2") {
  return "P[" + std::to_string(number) + "]{\n   GP1:\n\t" + frames +
         ",\t\tCONFIG : 'N U T, 0, 0, 0',\n"
         "\tX =  1200.000  mm,\tY =     -.011  mm,\tZ =   500.968  mm,\n"
         "\tW =   180.000 deg,\tP =     0.000 deg,\tR =   -90.040 deg\n};\n";
}

Reading Read(std::vector<SourceFile> files) {
  return FanucTp().Read(std::move(files));
}

Program ReadOne(const std::string& statements, const std::string& positions = "") {
  return Read({{"weld.ls", Listing(statements, positions)}}).program;
}

std::vector<Step> Steps(const Program& program, StepKind kind) {
  std::vector<Step> found;
  for (const Routine& routine : program.routines) {
    for (const Step& step : routine.steps) {
      if (step.kind == kind) found.push_back(step);
    }
  }
  return found;
}

TEST_CASE("a FANUC point has its six numbers where they are, its CONFIG, its frames") {
  const std::string text = Listing("   1:L P[1] 100mm/sec FINE    ;\n", Pose(1));
  const Program program = Read({{"weld.ls", text}}).program;
  REQUIRE(program.points.size() == 1);
  const Point& point = program.points[0];
  CHECK(point.name == "P[1]");
  CHECK(point.kind == PointKind::kPose);
  REQUIRE(point.numbers.size() == 6);
  const std::vector<std::string> written = {"1200.000", "-.011", "500.968",
                                            "180.000",  "0.000", "-90.040"};
  for (std::size_t i = 0; i < 6; ++i) {
    REQUIRE(point.numbers[i]);
    const Span& span = point.numbers[i]->span;
    CHECK(text.substr(span.begin, span.end - span.begin) == written[i]);
  }
  CHECK(point.numbers[1]->value == Approx(-0.011));
  REQUIRE(point.configuration.fields.size() == 1);
  CHECK(point.configuration.fields[0].text == "N U T, 0, 0, 0");
  CHECK(point.stated_tool == "UTOOL 2");
  CHECK(point.stated_base == "UFRAME 1");
  CHECK(point.untouchable.empty());
}

TEST_CASE("a FANUC point may be joints, in groups, on a rail, labelled, or not taught") {
  const Program program = ReadOne(
      "",
      "P[1:\"home ] {x}\"]{\n   GP1:\n\tUF : 0, UT : 1,\t\n\tJ1=     0.000 deg,\tJ2=   -10.000 deg,"
      "\tJ3=     5.000 deg,\n\tJ4=     0.000 deg,\tJ5=   -90.000 deg,\tJ6=     0.000 deg\n"
      "   GP2:\n\tUF : 0, UT : 1,\t\n\tJ1=   100.000  mm\n};\n"
      "P[2]{\n   GP1:\n\tUF : F, UT : F,\t\tCONFIG : '',\n\tX =********  mm,\tY =********  mm,\tZ "
      "=********  mm,\n\tW =******** deg,\tP =******** deg,\tR =******** deg\n};\n"
      "P[3]{\n   GP1:\n\tUF : 6, UT : 1,\t\tKONFIG : 'N U T, 0, 0, 0',\n\tX = 1.0  mm,\tY = 2.0  "
      "mm,"
      "\tZ = 3.0  mm,\n\tW = 4.0 deg,\tP = 5.0 deg,\tR = 6.0 deg,\n\tE1=  2580.816  mm\n};\n"
      "P[4]{\n   GP1:\n\tUF : 1, UT : 2,\t\tCONFIG : 'N U T, 0, 0, -1',\n\tRX = 1.0 mm,\tRY = 2.0 "
      "mm,\tRZ = 3.0 mm,\n\tRW = 4.0 deg,\tRP = 5.0 deg,\tRR = 6.0 deg\n};\n"
      "P[5]{\n   GP2:\n\tUF : 0, UT : 1,\t\n\tJ1=     6.378 deg\n};\n");
  REQUIRE(program.points.size() == 5);
  CHECK(program.points[0].kind == PointKind::kJoints);
  CHECK(program.points[0].numbers.size() == 6);
  REQUIRE(program.points[0].external_axes.size() == 1);
  CHECK(program.points[0].external_axes[0]->value == 100);
  CHECK(program.points[1].untouchable.find("not taught") == 0);
  CHECK(program.points[2].external_axes.at(0)->value == Approx(2580.816));
  CHECK(program.points[2].configuration.fields.size() == 1);
  CHECK(program.points[3].untouchable.find("stands in the cell") != std::string::npos);
  CHECK(program.points[4].untouchable.find("group 1") != std::string::npos);
}

TEST_CASE("FANUC motions: kinds, approximation, via points, what is no plain motion") {
  const Program program = ReadOne(
      "   1:J P[1] 100% FINE    ;\n"
      "   2:L P[1:start] 100mm/sec CNT50 ACC80    ;\n"
      "   3:L P[1] 100mm/sec CNT0    ;\n"
      "   4:C P[1]    \n    :  P[2] 50mm/sec FINE    ;\n"
      "   5:L P[1] 100mm/sec FINE INC    ;\n"
      "   6:L P[1] 100mm/sec FINE Skip,LBL[7],PR[7:z]=LPOS    ;\n"
      "   7:L P[1] 100mm/sec FINE COORD    ;\n"
      "   8:L P[1] 95mm/sec CNT0 TB    .10sec,P-SPS RTCP    ;\n"
      "      1:  DO[1]=ON ;\n       ------ ;\n"
      "   9:L PR[5:up] 100mm/sec FINE    ;\n"
      "  10:L P[1] 100mm/sec FINE Tool_Offset,PR[3] Offset,PR[4]    ;\n"
      "  11:A P[2] 100mm/sec CD10    ;\n"
      "  12:L P[1] WELD_SPEED CNT100 Wjnt\n    :  Weave Sine[5] Arc Start[1]    ;\n",
      Pose(1) + Pose(2));
  const auto steps = Steps(program, StepKind::kMotion);
  REQUIRE(steps.size() == 12);
  const auto motion = [&](std::size_t i) { return steps[i - 1].motion; };
  CHECK(motion(1).kind == MotionKind::kJoint);
  CHECK_FALSE(motion(1).passes_by);
  CHECK(motion(1).end.point == 0U);
  CHECK(motion(2).kind == MotionKind::kLinear);
  CHECK(motion(2).passes_by);
  CHECK_FALSE(motion(3).passes_by);
  REQUIRE(motion(4).via);
  CHECK(motion(4).kind == MotionKind::kCircular);
  CHECK(motion(4).via->point == 0U);
  CHECK(motion(4).end.point == 1U);
  for (const std::size_t i : {5, 6, 7, 8}) CHECK_FALSE(motion(i).special.empty());
  CHECK_FALSE(motion(9).end.point);
  CHECK(motion(9).end.computed == "PR[5:up]");
  CHECK(motion(10).end.offset.unknown.find("PR[3]") != std::string::npos);
  CHECK(motion(10).end.offset.unknown.find("PR[4]") != std::string::npos);
  CHECK(motion(11).passes_by);
  CHECK(motion(12).special.empty());
  CHECK_FALSE(motion(6).via);
  CHECK(steps[3].place.line == 12);
  const auto branches = Steps(program, StepKind::kBranch);
  REQUIRE(branches.size() == 1);
  CHECK(branches[0].label == "LBL[7]");
}

TEST_CASE("FANUC settings: constants are keys, computed and assigned ones are unknown") {
  const Program program = ReadOne(
      "   1:  UFRAME_NUM=1 ;\n   2:  UTOOL_NUM=R[5] ;\n   3:  PAYLOAD[2:gripper] ;\n"
      "   4:  PAYLOAD[R[13]] ;\n   5:  WKZ_NUM=3 ;\n   6:  BENUTZER_NUM=4 ;\n   7:  TRAGLST[5] ;\n"
      "   8:  UFRAME[4]=PR[1] ;\n   9:  UFRAME_NUM[GP2]=9 ;\n");
  const auto tools = Steps(program, StepKind::kSetTool), bases = Steps(program, StepKind::kSetBase),
             loads = Steps(program, StepKind::kSetLoad);
  REQUIRE(tools.size() == 2);
  REQUIRE(bases.size() == 2);
  REQUIRE(loads.size() == 3);
  CHECK(bases[0].setting.key == "UFRAME 1");
  CHECK_FALSE(tools[0].setting.unknown.empty());
  CHECK(tools[1].setting.key == "UTOOL 3");
  CHECK(bases[1].setting.unknown.find("weld.ls:16") != std::string::npos);
  CHECK(loads[0].setting.key == "PAYLOAD 2");
  CHECK_FALSE(loads[1].setting.unknown.empty());
  CHECK(loads[2].setting.key == "PAYLOAD 5");
}

TEST_CASE("FANUC programs and macros are called by name, also those that are not given") {
  const Reading reading =
      Read({{"main.ls", Listing("   1:  CALL SUB(1,2)    ;\n   2:  CALL OTHER    ;\n"
                                "   3:  OPEN HAND 1 ;\n   4:  UNLOCK PREG ;\n",
                                "", "MAIN")},
            {"sub.ls", Listing("   1:  END ;\n", "", "SUB")}});
  const Program& program = reading.program;
  REQUIRE(program.routines.size() == 2);
  CHECK(program.routines[0].starts);
  CHECK_FALSE(program.routines[1].starts);
  const auto calls = Steps(program, StepKind::kCall);
  REQUIRE(calls.size() == 3);
  CHECK(calls[0].label == "SUB");
  CHECK(calls[1].label == "OTHER");
  CHECK(calls[2].label == "OPEN HAND 1");
}

TEST_CASE("FANUC points that are copied, written or chosen at run time must stay") {
  const Program program =
      ReadOne("   1:  PR[5]=P[1] ;\n   2:  P[2,3]=R[1] ;\n   3:  !P[3] is a remark ;\n",  //
              Pose(1) + Pose(2) + Pose(3));
  const auto uses = Steps(program, StepKind::kUse);
  REQUIRE(uses.size() == 2);
  CHECK(uses[0].point == 0U);
  CHECK(uses[0].reason.find("PR[5]=P[1]") != std::string::npos);
  CHECK(uses[1].point == 1U);
  const Program any = ReadOne("   1:L P[R[1]] 100mm/sec FINE    ;\n", Pose(1) + Pose(2));
  CHECK_FALSE(any.points[0].untouchable.empty());
  CHECK_FALSE(any.points[1].untouchable.empty());
}

TEST_CASE("FANUC control flow becomes labels, jumps and branches") {
  const Program program = ReadOne(
      "   1:  LBL[1:loop] ;\n   2:  IF R[1]=1 AND (DI[2]=ON),JMP LBL[2] ;\n   3:  JMP LBL[1] ;\n"
      "   4:  LBL[2] ;\n   5:  SELECT R[1]=1,JMP LBL[1] ;\n       :       =2,CALL X ;\n"
      "       :       ELSE,JMP LBL[2] ;\n   6:  WAIT DI[1]=ON TIMEOUT,LBL[2] ;\n"
      "   7:  IF (R[1]>2) THEN ;\n   8:  UTOOL_NUM=1 ;\n   9:  ELSE ;\n  10:  UTOOL_NUM=2 ;\n"
      "  11:  ENDIF ;\n  12:  FOR R[1]=1 TO 3 ;\n  13:  ENDFOR ;\n  14:  JMP LBL[R[3]] ;\n");
  int to_first = 0;
  for (const Step& step : Steps(program, StepKind::kBranch)) to_first += step.label == "LBL[1]";
  CHECK(to_first == 1);  // from the computed jump: SELECT's is behind a branch of its own
  std::set<std::string> labels;
  for (const Step& step : Steps(program, StepKind::kLabel)) {
    CAPTURE(step.label);
    CHECK(labels.insert(step.label).second);
  }
  for (const StepKind kind : {StepKind::kJump, StepKind::kBranch}) {
    for (const Step& step : Steps(program, kind)) {
      CAPTURE(step.label);
      CHECK(labels.contains(step.label));
    }
  }
}

TEST_CASE("labels of a block that belongs to a FANUC motion are its own") {
  const Program program = ReadOne(
      "   1:J P[1] 100% CNT0 TB    .10sec,P-SPS    ;\n      1:  LBL[1] ;\n      2:  JMP LBL[1] ;\n"
      "       ------ ;\n   2:  LBL[1] ;\n",
      Pose(1));
  const auto labels = Steps(program, StepKind::kLabel);
  REQUIRE(labels.size() == 2);
  CHECK(labels[0].label != labels[1].label);
  CHECK(Steps(program, StepKind::kJump).at(0).label == labels[0].label);
}

TEST_CASE("frames, tools and payloads of a FANUC backup, of group 1 only") {
  const std::string listing =
      "[*SYSTEM*]$MNUFRAME  Storage: SHADOW  Access: RW  : ARRAY[2,32] OF POSITION\n"
      "    [1,1] = \n  Group: 1   Config: N U T, 0, 0, 0\n"
      "  X:  3495.600   Y:  5813.000   Z: -1166.400\n"
      "  W:      .140   P:      .080   R:   -90.040\n"
      "    [2,1] = \n  Group: 2   Config: N U T, 0, 0, 0\n  X: 1.0   Y: 1.0   Z: 1.0\n"
      "  W: 0.0   P: 0.0   R: 0.0\n\n"
      "[*SYSTEM*]$MNUTOOL  Storage: SHADOW  Access: RW  : ARRAY[2,32] OF POSITION\n"
      "    [1,2] =   ''\n  Group: 1   Config: N D B, 0, 0, 0\n  X: 0.0   Y: 0.0   Z: 150.0\n"
      "  W: 0.0   P: 0.0   R: 90.0\n"
      "[*SYSTEM*]$PLST_GRP1  Storage: SHADOW  Access: RO  : ARRAY[20] OF PLST_GRP_T\n"
      "     Field: $PLST_GRP1[1].$PAYLOAD Access: RO: REAL = 3.450000e+02\n"
      "     Field: $PLST_GRP1[1].$PAYLOAD_Y Access: RO: REAL = 4.000000e+01\n"
      "     Field: $PLST_GRP1[2].$PAYLOAD Access: RO: REAL = -9.999000e+03\n";
  const Program program = Read({{"sysframe.va", listing}}).program;
  REQUIRE(program.bases.contains("UFRAME 1"));
  CHECK(program.bases.at("UFRAME 1").X.p.isApprox(Vec3(3.4956, 5.813, -1.1664)));
  REQUIRE(program.tools.contains("UTOOL 2"));
  CHECK(program.tools.at("UTOOL 2").X.p.z() == Approx(0.15));
  CHECK(program.tools.at("UTOOL 2").X.R(1, 0) == Approx(1));
  CHECK(program.loads.at("PAYLOAD 1").mass_kg == 345.0);
  CHECK(program.loads.at("PAYLOAD 1").cog_F.y() == Approx(0.4));
  CHECK_FALSE(program.loads.at("PAYLOAD 2").mass_kg);
  CHECK(program.tools.contains("UTOOL 0"));
  CHECK(program.bases.contains("UFRAME 0"));
}

TEST_CASE("FANUC listings in CRLF and 8 bits, without a last line end, and compiled programs") {
  std::string text = Listing(
      "   1:  !Gr\xFC\xDF"
      "e ;\n   2:J P[1] 100% FINE ;\n",
      Pose(1));
  std::string crlf;
  for (const char c : text) crlf += c == '\n' ? std::string("\r\n") : std::string(1, c);
  crlf.resize(crlf.size() - 2);
  const SourceFile file{"weld.LS", crlf};
  CHECK(FanucTp().Recognises(file));
  const Program program = Read({file}).program;
  CHECK(program.points.size() == 1);
  CHECK(Steps(program, StepKind::kMotion).size() == 1);
  CHECK(FanucTp().Recognises({"weld.tp", std::string("\x01\x02\0", 3)}));
  CHECK(Read({{"weld.tp", "\x01\x02"}}).refusals.size() == 1);
  CHECK_FALSE(FanucTp().Recognises({"weld.src", "DEF weld()\n"}));
}

/// An arm as FANUC counts its joints, upright and level at 0 (J3 as an axis).
kinematics::Chain Arm() {
  model::Robot robot;
  robot.convention = model::DhConvention::kDistal;
  const auto joint = [&robot](double a, double alpha, double d, double offset, int sign) {
    model::Joint& added = robot.joints.emplace_back();
    added.a_m = a, added.alpha_rad = alpha, added.d_m = d, added.theta_offset_rad = offset;
    added.sign = sign;
  };
  const double right = 1.5707963267948966;
  joint(0.15, -right, 0, 0, 1);
  joint(0.79, 0, 0, -right, 1);
  joint(0.25, -right, 0, 0, -1);
  joint(0, right, 0.835, 0, -1);
  joint(0, -right, 0, 0, -1);
  joint(0, 0, 0.1, 0, -1);
  return kinematics::Chain(robot);
}

model::JointVector Degrees(std::vector<double> q) {
  model::JointVector joints(static_cast<int>(q.size()));
  for (int i = 0; i < joints.size(); ++i)
    joints[i] = q[static_cast<std::size_t>(i)] * 0.017453292519943295;
  return joints;
}

TEST_CASE("CONFIG names flip by J5, elbow and front as at zero, and whole turns") {
  const kinematics::Chain arm = Arm();
  const auto agrees = [&](const char* config, std::vector<double> q, bool turns = true) {
    return fanuc::ConfigAgrees(config, arm, Degrees(std::move(q)), turns);
  };
  CHECK(agrees("N U T, 0, 0, 0", {-70, -25, 0, 0, -89, -20}));
  CHECK_FALSE(agrees("F U T, 0, 0, 0", {-70, -25, 0, 0, -89, -20}));
  CHECK(agrees("F U T, 0, 0, 0", {10, 20, 0, 170, 40, 0}));
  CHECK(agrees("N U B, 0, 0, 0", {10, -90, 60, 0, -40, 0}));
  CHECK_FALSE(agrees("N U T, 0, 0, 0", {10, -90, 60, 0, -40, 0}));
  CHECK(agrees("N D T, 0, 0, 0", {10, 100, -150, 0, -40, 0}));
  CHECK(agrees("N U T, 0, 0, 1", {0, 0, 0, 0, -40, 200}));
  CHECK_FALSE(agrees("N U T, 0, 0, 0", {0, 0, 0, 0, -40, 200}));
  CHECK(agrees("N U T, 0, 0, 0", {0, 0, 0, 0, -40, 200}, false));
  CHECK(agrees("N U T, 0, -1, 0", {0, 0, 0, -190, -40, 0}));
  CHECK(agrees("N U T, 0, 0, 0", {0, 0, 0, 0, 0, 0}));
  CHECK(agrees("F U T, 0, 0, 0", {0, 0, 0, 0, 0, 0}));
}

TEST_CASE("CONFIG is rewritten only where a posture has left it, in its own form") {
  const kinematics::Chain arm = Arm();
  const auto written = [&](const char* config, std::vector<double> q) {
    return fanuc::ConfigFor(config, arm, Degrees(std::move(q)));
  };
  CHECK(written("N U T, 0, 0, 0", {0, 0, 0, 0, -40, 20}) == "N U T, 0, 0, 0");
  CHECK(written("N U T, 0, 0, 0", {0, 0, 0, 0, 40, 20}) == "F U T, 0, 0, 0");
  CHECK(written("N U T,  0, 0,0", {0, 0, 0, 0, -40, -181}) == "N U T,  0, 0,-1");
  // Turns of J4, J5 and J6.
  CHECK(written("N U T, 1, 0, 0", {0, 0, 0, 200, -40, 185}) == "N U T, 1, 0, 1");
}

TEST_CASE("W, P, R stay on the branch of the old numbers, also at a middle angle of 90 deg") {
  const Conventions& conventions = FanucTp().conventions();
  const auto again = [&](std::vector<double> numbers) {
    return conventions.numbers(*conventions.rotation(numbers), numbers);
  };
  for (const std::vector<double>& numbers : {std::vector<double>{10, 20, 30},
                                             {190, 160, 200},
                                             {-179.999, 0.5, 180},
                                             {30, 90, -50},
                                             {-170, -90, 20},
                                             {10, 91, 20}}) {
    const std::vector<double> back = again(numbers);
    for (std::size_t i = 0; i < 3; ++i) CHECK(back[i] == Approx(numbers[i]).margin(1e-5));
  }
  const Mat3 R = *conventions.rotation(std::vector<double>{-179.99, 0, 0});
  const std::vector<double> old = {179.99, 0, 0};
  CHECK(conventions.numbers(R, old)[0] == Approx(-179.99));
}

TEST_CASE("a FANUC listing of 5 MB of brackets and blocks ends") {
  std::string nasty = "   1:  ";
  for (int i = 0; i < 800000; ++i) nasty += "P[P[[";
  std::string deep;
  for (int i = 0; i < 100000; ++i) deep += "   1:  IF (R[1]=1) THEN ;\n";
  std::string chain = "   1:  IF a";
  for (int i = 0; i < 100000; ++i) chain += ",IF a";
  const Program program =
      ReadOne(nasty + " ;\n" + deep + chain + " ;\n" + nasty, "P[1]{" + nasty + "\nP[2" + nasty);
  CHECK(program.routines.size() == 1);
}

}  // namespace plumbline::fanuc_test
