#include "app/programs/brands/krl.h"

#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "app/programs/brands/krl_posture.h"
#include "app/programs/brands/krl_text.h"

namespace plumbline::krl_test {

using namespace plumbline::programs;

constexpr double kDeg = std::numbers::pi / 180;

const std::string kConfig =
    "DEFDAT $CONFIG\n"
    "DECL FRAME TOOL_DATA[16]\n"
    "TOOL_DATA[1]={X 0.0,Y 0.0,Z 200.0,A 0.0,B 0.0,C 0.0}\n"
    "TOOL_DATA[2]={X 10.0,Y 0.0,Z 300.0,A 0.0,B 90.0,C 0.0}\n"
    "DECL FRAME BASE_DATA[32]\n"
    "BASE_DATA[1]={X 1000.0,Y 0.0,Z 500.0,A 90.0,B 0.0,C 0.0}\n"
    "DECL LOAD LOAD_DATA[16]\n"
    "LOAD_DATA[1]={M 50.0,CM {X 10.0,Y 0.0,Z 100.0,A 0.0,B 0.0,C 0.0},J {X 0.0,Y 0.0,Z 0.0}}\n"
    "LOAD_DATA[2]={M -1.0,CM {X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0},J {X 0.0,Y 0.0,Z 0.0}}\n"
    "ENDDAT\n";

Reading ReadWith(const std::string& src, const std::string& dat = "DEFDAT WELD\nENDDAT\n") {
  return KrlBrand().Read({{"weld.src", src}, {"weld.dat", dat}, {"$config.dat", kConfig}});
}

/// A program WELD with these lines, and with these in its .dat.
Reading Weld(const std::string& lines, const std::string& data = "") {
  return ReadWith("DEF WELD( )\n" + lines + "END\n", "DEFDAT WELD\n" + data + "ENDDAT\n");
}

const std::string kP1 = "DECL E6POS XP1={X 100.5,Y 2,Z -3.25,A 10,B 20,C 30,S 2,T 10,E1 0.0}\n";

std::vector<Step> Steps(const Reading& reading, StepKind kind) {
  std::vector<Step> found;
  for (const Routine& routine : reading.program.routines) {
    std::ranges::copy_if(routine.steps, std::back_inserter(found),
                         [&](const Step& step) { return step.kind == kind; });
  }
  return found;
}

std::string ReasonOf(const Reading& reading) {
  const auto uses = Steps(reading, StepKind::kUse);
  return uses.empty() ? "" : uses.front().reason;
}

TEST_CASE("a point of the .dat is found with its numbers, status and turn") {
  const Reading reading = Weld("LIN XP1\n", kP1);
  REQUIRE(reading.program.points.size() == 1);
  const Point& point = reading.program.points[0];
  CHECK(point.name == "XP1");
  CHECK(point.place.file == 1);
  CHECK(point.place.line == 2);
  CHECK(point.untouchable.empty());
  CHECK(point.numbers[2]->value == -3.25);
  const Span span = point.numbers[2]->span;
  CHECK(reading.program.files[1].bytes.substr(span.begin, span.end - span.begin) == "-3.25");
  REQUIRE(point.configuration.fields.size() == 2);
  CHECK(point.configuration.fields[1].text == "10");
  CHECK(point.external_axes.empty());
  const auto motions = Steps(reading, StepKind::kMotion);
  REQUIRE(motions.size() == 1);
  CHECK(motions[0].motion.kind == MotionKind::kLinear);
  CHECK(motions[0].motion.end.point == 0u);
}

TEST_CASE("frames set by inline forms of both kinds") {
  const std::string records =
      "DECL FDAT FP1={TOOL_NO 2,BASE_NO 1,IPO_FRAME #BASE,POINT2[] \" \",TQ_STATE FALSE}\n";
  const Reading classic = Weld(
      ";FOLD LIN P1 Vel=1 m/s CPDAT1 Tool[2] Base[1];%{PE}\n"
      "$BWDSTART=FALSE\nLDAT_ACT=LCPDAT1\nFDAT_ACT=FP1\nBAS(#CP_PARAMS,1.0)\nLIN XP1 C_DIS\n"
      ";ENDFOLD\n",
      kP1 + records);
  CHECK(Steps(classic, StepKind::kSetTool).at(0).setting == Setting{"TOOL_DATA[2]", ""});
  CHECK(Steps(classic, StepKind::kSetBase).at(0).setting == Setting{"BASE_DATA[1]", ""});
  CHECK(Steps(classic, StepKind::kSetLoad).at(0).setting == Setting{"LOAD_DATA[2]", ""});
  CHECK(Steps(classic, StepKind::kMotion).at(0).motion.passes_by);

  const Reading spline = Weld(
      "SPTP XP1 WITH $VEL_AXIS[1]=SVEL_JOINT(50.0), $TOOL=STOOL2(FP1), $BASE=SBASE(FP1.BASE_NO), "
      "$IPO_MODE=SIPO_MODE(FP1.IPO_FRAME), $LOAD=SLOAD(FP1.TOOL_NO) C_SPL\n",
      kP1 + records);
  const Motion motion = Steps(spline, StepKind::kMotion).at(0).motion;
  CHECK(motion.tool == Setting{"TOOL_DATA[2]", ""});
  CHECK(motion.base == Setting{"BASE_DATA[1]", ""});
  CHECK(motion.load == Setting{"LOAD_DATA[2]", ""});
  CHECK(motion.special.empty());
}

TEST_CASE("a stationary tool is no ordinary motion") {
  const std::string records = "DECL FDAT FP1={TOOL_NO 1,BASE_NO 1,IPO_FRAME #TCP}\n";
  const Reading with = Weld("SLIN XP1 WITH $TOOL=STOOL2(FP1)\n", kP1 + records);
  CHECK_THAT(Steps(with, StepKind::kMotion).at(0).motion.special, Catch::Contains("#TCP"));
  const Reading bas = Weld("FDAT_ACT=FP1\nBAS(#FRAMES)\nLIN XP1\n", kP1 + records);
  CHECK_THAT(Steps(bas, StepKind::kShift).at(0).setting.unknown, Catch::Contains("stationary"));
}

TEST_CASE("tools, bases and loads of $config.dat; a mass of -1 was not entered") {
  const Program program = Weld("").program;
  CHECK(program.tools.at("TOOL_DATA[1]").X.p.isApprox(Vec3(0, 0, 0.2)));
  CHECK(program.bases.at("BASE_DATA[1]").X.p.isApprox(Vec3(1, 0, 0.5)));
  CHECK(program.bases.at("BASE_DATA[1]").X.R.col(0).isApprox(Vec3::UnitY()));
  CHECK(program.loads.at("LOAD_DATA[1]").mass_kg == 50.0);
  CHECK(program.loads.at("LOAD_DATA[1]").cog_F.isApprox(Vec3(0.01, 0, 0.1)));
  CHECK_FALSE(program.loads.at("LOAD_DATA[2]").mass_kg);
}

TEST_CASE("bases are given in the robot's base frame, which $ROBROOT places in the world") {
  const Reading reading = KrlBrand().Read({{"$config.dat", kConfig},
                                           {"$machine.dat",
                                            "DEFDAT $MACHINE PUBLIC\nFRAME $ROBROOT={X 0.0,Y 0.0,Z "
                                            "400.0,A 0.0,B 0.0,C 0.0}\nENDDAT\n"}});
  CHECK(reading.program.bases.at("BASE_DATA[1]").X.p.isApprox(Vec3(1, 0, 0.1)));
  CHECK(reading.program.bases.at("$WORLD").X.p.isApprox(Vec3(0, 0, -0.4)));
}

TEST_CASE("a tool that the program assigns has no fixed value") {
  const Reading reading = Weld("TOOL_DATA[1].Z=TOOL_DATA[1].Z+1\n$TOOL=TOOL_DATA[1]\n");
  CHECK_THAT(reading.program.tools.at("TOOL_DATA[1]").changes, Catch::Contains("weld.src:2"));
  CHECK(reading.program.tools.at("TOOL_DATA[2]").changes.empty());
}

TEST_CASE("a base on an external axis has no fixed value") {
  std::string config = kConfig;
  config.insert(config.find("ENDDAT"),
                "MACHINE_FRAME_DAT[1]={MACH_DEF_INDEX 2}\nMACHINE_DEF[2]={MECH_TYPE #EASYS}\n");
  const Reading reading = KrlBrand().Read({{"$config.dat", config}});
  CHECK_THAT(reading.program.bases.at("BASE_DATA[1]").changes, Catch::Contains("external axis"));
}

TEST_CASE("every use other than as a target has its reason") {
  for (const auto& [line, reason] : std::initializer_list<std::pair<const char*, const char*>>{
           {"XQ=XP1\n", "copied to XQ"},
           {"MoveTo(XP1)\n", "passed to MoveTo()"},
           {"H=XP1.Z\n", "component z is read"},
           {"IF XP1.X>5 THEN\nENDIF\n", "component x is read"},
           {"LIN_REL XP1\n", "relative motion"},
           {"$BASE=XP1\n", "$BASE is set to it"},
           {"LIN XP2:XP1\n", "shifts XP2"},
           {"RETURN XP1\n", "returned"}}) {
    CAPTURE(line);
    const Reading reading = Weld(line, kP1 + "DECL E6POS XP2={X 1,Y 2,Z 3,A 4,B 5,C 6}\n");
    CHECK_THAT(ReasonOf(reading), Catch::Contains(reason));
    CHECK(Steps(reading, StepKind::kUse).at(0).point == 0u);
  }
}

TEST_CASE("a point that the program computes is left alone, and so is a motion to it") {
  const Reading reading = Weld("XP1.Z=XP1.Z+10\nLIN XP1\n", kP1);
  CHECK_THAT(reading.program.points[0].untouchable, Catch::Contains("weld.src:2"));
  const Target target = Steps(reading, StepKind::kMotion).at(0).motion.end;
  CHECK_FALSE(target.point);
  CHECK(target.computed == "XP1");
}

TEST_CASE("a literal in a motion, and one that is assigned once, are points") {
  const Reading reading = Weld(
      "DECL FRAME F\nF={X 1,Y 2,Z 3,A 0,B 0,C 0}\nLIN F\nPTP {A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}\n"
      "LIN {X 5}\n");
  REQUIRE(reading.program.points.size() == 3);
  CHECK(reading.program.points[0].name == "F");
  CHECK(reading.program.points[0].untouchable.empty());
  CHECK(reading.program.points[1].kind == PointKind::kJoints);
  CHECK_FALSE(reading.program.points[2].numbers[1]);
  const auto motions = Steps(reading, StepKind::kMotion);
  CHECK(motions.at(0).motion.end.point == 0u);

  const Reading twice = Weld(
      "DECL FRAME F\nF={X 1,Y 2,Z 3,A 0,B 0,C 0}\nLIN F\nF={X 2,Y 2,Z 3,A 0,B 0,C 0}\nLIN F\n");
  CHECK_FALSE(twice.program.points.at(0).untouchable.empty());
  CHECK_FALSE(twice.program.points.at(1).untouchable.empty());
}

TEST_CASE("the geometric operator shifts a point by a constant pose on either side") {
  const Reading reading = Weld(
      "LIN XP1:{X 0,Y 0,Z 50,A 0,B 0,C 0}\nLIN {X 0,Y 7,Z 0,A 0,B 0,C 0}:XP1\n"
      "LIN $NULLFRAME:XP1\n",
      kP1);
  const auto motions = Steps(reading, StepKind::kMotion);
  REQUIRE(motions.size() == 3);
  CHECK(motions[0].motion.end.point == 0u);
  CHECK(motions[0].motion.end.offset.in == Offset::In::kTool);
  CHECK(motions[0].motion.end.offset.X.p.isApprox(Vec3(0, 0, 0.05)));
  CHECK(motions[1].motion.end.offset.in == Offset::In::kBase);
  CHECK(motions[1].motion.end.offset.X.p.isApprox(Vec3(0, 0.007, 0)));
  CHECK(motions[2].motion.end.offset.in == Offset::In::kNone);
}

TEST_CASE("a motion to an element that is not known goes to each of them") {
  const Reading reading = Weld("FOR I=1 TO 2\nLIN TAB[I]\nENDFOR\n",
                               "DECL POS TAB[2]\nTAB[1]={X 1,Y 0,Z 0,A 0,B 0,C 0}\n"
                               "TAB[2]={X 2,Y 0,Z 0,A 0,B 0,C 0}\nDECL INT I=1\n");
  const auto motions = Steps(reading, StepKind::kMotion);
  REQUIRE(motions.size() == 2);
  CHECK(motions[0].motion.end.point == 0u);
  CHECK(motions[1].motion.end.point == 1u);
}

TEST_CASE("points in declared structures are points, those in others are left alone") {
  const std::string value = "JOB[1]={P {X 1,Y 0,Z 0,A 0,B 0,C 0},V 0.5}\n";
  const Reading declared =
      Weld("LIN JOB[1].P\n", "STRUC JOBTYPE E6POS P,REAL V\nDECL JOBTYPE JOB[3]\n" + value);
  CHECK(declared.program.points.at(0).untouchable.empty());
  CHECK(Steps(declared, StepKind::kMotion).at(0).motion.end.point == 0u);
  const Reading unknown = Weld("LIN JOB[1].P\n", "DECL JOBTYPE JOB[3]\n" + value);
  CHECK_THAT(unknown.program.points.at(0).untouchable, Catch::Contains("jobtype"));
}

TEST_CASE("points of public data are visible to the other programs of the controller") {
  const std::string src = "DEF WELD( )\nLIN XP1\nEND\n";
  const Reading open =
      ReadWith(src, "DEFDAT WELD PUBLIC\nDECL GLOBAL " + kP1.substr(5) + "ENDDAT\n");
  CHECK(open.program.points[0].visible_to == Visibility::kController);
  const Reading own = ReadWith(src, "DEFDAT WELD\n" + kP1 + "ENDDAT\n");
  CHECK(own.program.points[0].visible_to == Visibility::kFiles);
}

TEST_CASE("points whose .src is missing are left alone") {
  const Reading reading = KrlBrand().Read({{"weld.dat", "DEFDAT WELD\n" + kP1 + "ENDDAT\n"}});
  CHECK_THAT(reading.program.points.at(0).untouchable, Catch::Contains("give WELD.src"));
}

TEST_CASE("untaught points and the mark of the absolutely accurate model") {
  const Reading reading =
      Weld("",
           "DECL E6POS XP1={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0,S 0,T 0}\n"
           "DECL E6POS XP2={X 1,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0,S 18,T 0}\n"
           "DECL E6POS XP3={X 1,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0,S 'B00010110',T 0}\n"
           "DECL E6POS XP4={X 1,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0,S 'B00110',T 0}\n");
  CHECK_THAT(reading.program.points[0].untouchable, Catch::Contains("not taught"));
  CHECK(reading.program.points[1].absolutely_accurate);
  CHECK(reading.program.points[2].absolutely_accurate);
  CHECK_FALSE(reading.program.points[3].absolutely_accurate);
}

TEST_CASE("comments, headers and folds are not read") {
  const Reading reading = Weld(
      "&PARAM X={X 1,Y 2,Z 3}\n;FOLD PTP P9 ={X 1,Y 2,Z 3,A 0,B 0,C 0};%{PE}\n;PTP XP1\n"
      ";LIN {X 1,Y 2,Z 3,A 0,B 0,C 0}\n;ENDFOLD\nMSG[]=\"LIN {X 1,Y 2,Z 3};\"\n",
      kP1);
  CHECK(reading.program.points.size() == 1);
  CHECK(Steps(reading, StepKind::kMotion).empty());
}

TEST_CASE("circles, spline blocks and relative motions") {
  const Reading reading = Weld(
      "CIRC XP1, {X 9,Y 0,Z 0,A 0,B 0,C 0} C_DIS\nCIRC XP1, XP1, CA 360\n"
      "SPLINE WITH $TOOL=TOOL_DATA[2]\nSPL XP1\nSLIN XP1\nENDSPLINE\nLIN_REL {Z 10} #TOOL\n",
      kP1);
  const auto motions = Steps(reading, StepKind::kMotion);
  REQUIRE(motions.size() == 5);
  CHECK(motions[0].motion.kind == MotionKind::kCircular);
  CHECK(motions[0].motion.via->point == 0u);
  CHECK(motions[0].motion.end.point == 1u);
  CHECK(motions[0].motion.passes_by);
  CHECK_THAT(motions[1].motion.special, Catch::Contains("CA"));
  CHECK(motions[2].motion.kind == MotionKind::kSpline);
  CHECK(motions[2].motion.tool == Setting{"TOOL_DATA[2]", ""});
  CHECK(motions[3].motion.tool == Setting{"TOOL_DATA[2]", ""});
  CHECK(motions[4].motion.special == "relative motion");
  CHECK_FALSE(motions[4].motion.tool);
}

TEST_CASE("blocks become labels that exist, for every construct of control flow") {
  const Reading reading = Weld(
      "INT I\nFOR I=1 TO 3\nIF I==1 THEN\nLIN XP1\nELSE\nLIN XP1\nENDIF\nENDFOR\n"
      "WHILE $IN[1]\nLOOP\nEXIT\nENDLOOP\nENDWHILE\nREPEAT\nLIN XP1\nUNTIL $IN[2]\n"
      "SWITCH I\nCASE 1,2\nLIN XP1\nCASE 3\nLIN XP1\nDEFAULT\nHALT\nENDSWITCH\n"
      "GOTO AGAIN\nAGAIN:\nRETURN\n",
      kP1);
  CHECK(std::ranges::none_of(reading.program.remarks,
                             [](const Remark& remark) { return remark.place.file == 0; }));
  std::vector<std::string> labels, targets;
  for (const Step& step : Steps(reading, StepKind::kLabel)) labels.push_back(step.label);
  for (const StepKind kind : {StepKind::kJump, StepKind::kBranch}) {
    for (const Step& step : Steps(reading, kind)) targets.push_back(step.label);
  }
  CHECK(targets.size() > 10);
  for (const std::string& target : targets) CHECK(std::ranges::count(labels, target) == 1);
}

TEST_CASE("blocks that do not match make the points of the routine unusable, not the reader") {
  const Reading reading = Weld("IF $IN[1] THEN\nLIN XP1\n", kP1);
  CHECK_THAT(ReasonOf(reading), Catch::Contains("not understood"));
}

TEST_CASE("routines are called by name, also those that are not given") {
  const Reading reading = ReadWith("DEF WELD( )\nSUB( )\nOTHER( )\nEND\nDEF SUB( )\nEND\n");
  const auto calls = Steps(reading, StepKind::kCall);
  REQUIRE(calls.size() == 2);
  CHECK(calls[0].label == reading.program.routines[1].name);
  CHECK(calls[1].label == "OTHER");
  CHECK(reading.program.routines[0].starts);
  CHECK_FALSE(reading.program.routines[1].starts);
}

TEST_CASE("an interrupt may run, and one with RESUME may end a motion") {
  const Reading reading = ReadWith(
      "DEF WELD( )\nINTERRUPT DECL 5 WHEN $IN[1] DO AWAY( )\nINTERRUPT ON 5\nLIN XP1\nEND\n"
      "DEF AWAY( )\n$TOOL=TOOL_DATA[2]\nEND\n",
      "DEFDAT WELD\n" + kP1 + "ENDDAT\n");
  CHECK(Steps(reading, StepKind::kEnableInterrupt).at(0).label == reading.program.routines[1].name);
  CHECK_FALSE(reading.program.routines[1].starts);

  const Reading search = ReadWith(
      "DEF WELD( )\nINTERRUPT DECL 5 WHEN $IN[1] DO FOUND( )\nINTERRUPT ON 5\nLIN XP1\n"
      "INTERRUPT OFF 5\nLIN XP1\nEND\nDEF FOUND( )\nBRAKE\nRESUME\nEND\n",
      "DEFDAT WELD\n" + kP1 + "ENDDAT\n");
  const auto motions = Steps(search, StepKind::kMotion);
  CHECK_THAT(motions.at(0).motion.special, Catch::Contains("search"));
  CHECK(motions.at(1).motion.special.empty());
}

TEST_CASE("a module that is given twice is refused the second time") {
  const Reading reading =
      KrlBrand().Read({{"a/weld.src", "DEF WELD( )\nEND\n"}, {"b/weld.src", "DEF WELD( )\nEND\n"}});
  REQUIRE(reading.refusals.size() == 1);
  CHECK(reading.refusals[0].file == 1);
}

TEST_CASE("files are recognised by name and head") {
  const auto recognised = [](const char* name, const char* bytes) {
    return KrlBrand().Recognises({name, bytes});
  };
  CHECK(recognised("a.src", "&ACCESS RVP\r\n&REL 3\r\nDEF a( )\r\nEND\r\n"));
  CHECK(recognised("A.SRC", "; \xC4nderung\nDEF a( )\nEND\n"));
  CHECK(recognised("$config.dat", "DEFDAT $CONFIG\nENDDAT\n"));
  CHECK(recognised("copy.txt", "&ACCESS RVP\nDEF a( )\nEND\n"));
  CHECK_FALSE(recognised("a.dat", "1.0 2.0 3.0\n"));
  CHECK_FALSE(recognised("a.script", "def weld():\nend\n"));
}

TEST_CASE("a mark is inserted behind DEF with the line end of the file, and found again") {
  for (const std::string line_end : {"\n", "\r\n"}) {
    for (const std::string head : {"DEF A( )", "DEFDAT A"}) {
      SourceFile file{"a.src", "&ACCESS RVP" + line_end + head + line_end + "END" + line_end};
      const auto insertion = KrlBrand().Mark(file, "corrected 1");
      REQUIRE(insertion);
      CHECK(insertion->text.ends_with("corrected 1" + line_end));
      file.bytes.insert(insertion->at, insertion->text);
      CHECK(file.bytes.starts_with("&ACCESS RVP" + line_end + head + line_end + "; "));
      CHECK(KrlBrand().Read({file}).program.marks.at(0) == "corrected 1");
    }
  }
  CHECK_FALSE(KrlBrand().Mark({"a.src", "nothing"}, "x"));
}

TEST_CASE("a motion that is inserted looks like its original") {
  const std::string src =
      "DEF WELD( )\r\n  SLIN XP1 WITH $TOOL=STOOL2(FP1) C_SPL ; seam\r\n  LIN XP1\r\nPTP "
      "XP1\r\nEND\r\n";
  const Reading reading = ReadWith(src, "DEFDAT WELD\n" + kP1 + "ENDDAT\n");
  const auto motions = Steps(reading, StepKind::kMotion);
  const std::vector<double> numbers = {1, 2.5, -0.00004, 10.00001, 0, -179.5};
  const auto text = [&](std::size_t i) {
    return KrlBrand().InsertedMotion(reading.program, motions.at(i).motion, numbers, 0.1);
  };
  CHECK(text(0) ==
        "SLIN {X 1.0,Y 2.5,Z 0.0,A 10.00001,B 0.0,C -179.5} WITH $TOOL=STOOL2(FP1) C_SPL\r\n  ");
  CHECK(text(1) == "LIN {X 1.0,Y 2.5,Z 0.0,A 10.00001,B 0.0,C -179.5}\r\n  ");
  CHECK_FALSE(text(2));
}

Mat3 Rotation(double a, double b, double c) {
  const std::array<double, 3> angles = {a, b, c};
  return *KrlBrand().conventions().rotation(angles);
}

TEST_CASE("orientations are Rz(A) Ry(B) Rx(C)") {
  CHECK(Rotation(90, 0, 0).col(0).isApprox(Vec3::UnitY()));
  CHECK(Rotation(0, 90, 0).col(0).isApprox(-Vec3::UnitZ()));
  CHECK(Rotation(0, 0, 90).col(1).isApprox(Vec3::UnitZ()));
  CHECK((Rotation(90, 0, 90) * Vec3::UnitY()).isApprox(Vec3::UnitZ()));
}

/// The KR 210 R2700-2 of config/cells, as its controller counts the joints.
kinematics::Chain Kr210() {
  model::Robot robot;
  const double table[6][5] = {{330, -90, 645, 0, -1}, {1150, 0, 0, 0, 1}, {115, -90, 0, -90, 1},
                              {0, 90, 1220, 0, -1},   {0, -90, 0, 0, 1},  {0, 0, 215, 180, -1}};
  for (const auto& row : table) {
    model::Joint joint;
    joint.a_m = row[0] / 1e3;
    joint.alpha_rad = row[1] * kDeg;
    joint.d_m = row[2] / 1e3;
    joint.theta_offset_rad = row[3] * kDeg;
    joint.sign = row[4] < 0 ? -1 : 1;
    robot.joints.push_back(joint);
  }
  return kinematics::Chain(robot);
}

model::JointVector JointsOf(std::initializer_list<double> degrees) {
  model::JointVector q(6);
  int i = 0;
  for (const double degree : degrees) q[i++] = degree * kDeg;
  return q;
}

TEST_CASE("status and turn of a KR 210") {
  const kinematics::Chain chain = Kr210();
  const auto posture = [&](std::initializer_list<double> degrees) {
    return *krl::PostureOf(chain, JointsOf(degrees));
  };
  // The link arm upright and the arm forward: what most taught points have.
  CHECK(posture({0, -90, 90, 0, 30, 0}).status == 2);
  CHECK(posture({-20, -90, 90, 0, -30, 10}).status == 6);
  CHECK(posture({-20, -90, 90, 0, -30, -10}).turn == 1 + 2 + 16 + 32);
  // The elbow bent the other way: A3 below the angle at which axes 2, 3 and 5 are in line.
  CHECK(posture({0, -20, -30, 0, 30, 0}).status == 0);
  // Overhead: the wrist centre behind axis 1, whichever way axis 1 points.
  for (const double a1 : {0.0, 90.0, -135.0}) {
    CHECK((posture({a1, -140, 0, 0, 30, 0}).status & 1) == 1);
    CHECK((posture({a1, -40, 40, 0, 30, 0}).status & 1) == 0);
  }
}

TEST_CASE("status and turn bind point-to-point motions only, and keep their notation") {
  const kinematics::Chain chain = Kr210();
  const Brand& krl = KrlBrand();
  const auto stated = [](std::string s, std::string t) {
    return Configuration{{{"S", {}, std::move(s)}, {"T", {}, std::move(t)}}};
  };
  const model::JointVector q = JointsOf({-20, -90, 90, 5, -30, -10});  // S 6, T 51
  CHECK(krl.Agrees(stated("6", "51"), chain, q, MotionKind::kJoint));
  CHECK(krl.Agrees(stated("22", "51"), chain, q, MotionKind::kJoint));
  CHECK_FALSE(krl.Agrees(stated("2", "51"), chain, q, MotionKind::kJoint));
  CHECK_FALSE(krl.Agrees(stated("6", "50"), chain, q, MotionKind::kJoint));
  CHECK(krl.Agrees(stated("2", "0"), chain, q, MotionKind::kLinear));
  CHECK(krl.Agrees({}, chain, q, MotionKind::kJoint));
  CHECK(krl.ConfigurationOf(stated("22", "51"), chain, q) == std::vector<std::string>{"22", "51"});
  CHECK(krl.ConfigurationOf(stated("'B00010010'", "'H32'"), chain, q) ==
        std::vector<std::string>{"'B00010110'", "'H33'"});
}

TEST_CASE("bit strings are written as they were") {
  CHECK(krl::WholeNumberIn("'B00010110'") == 22);
  CHECK(krl::WholeNumberIn("'HfF'") == 255);
  CHECK(krl::WholeNumberIn("35") == 35);
  for (const char* wrong : {"", "'B2'", "'X1'", "'B'", "1.5", "B1", "99999999999999999999"}) {
    CAPTURE(wrong);
    CHECK_FALSE(krl::WholeNumberIn(wrong));
  }
  CHECK(krl::WholeNumberLike("'B0010'", 18) == "'B10010'");
  CHECK(krl::WholeNumberLike("7", 34) == "34");
}

TEST_CASE("a motion to a point that no file declares asks for the .dat") {
  const Reading reading = Weld("LIN XP9\n");
  const auto motions = Steps(reading, StepKind::kMotion);
  REQUIRE(motions.size() == 1);
  CHECK_FALSE(motions[0].motion.end.point);
  CHECK(motions[0].motion.end.computed == "XP9");
  CHECK_THAT(motions[0].motion.end.missing, Catch::Contains("give the .dat"));
}

TEST_CASE("numbers of KRL need three decimals, and no significant digits") {
  for (const NumberStyle& style :
       {KrlBrand().conventions().length, KrlBrand().conventions().angle}) {
    CHECK(style.least_significant == 0);
    CHECK(style.least_decimals == 3);
  }
}

TEST_CASE("a block that is not closed counts as not read") {
  const Reading reading = Weld("LOOP\nLIN XP1\n", kP1);
  CHECK(std::ranges::any_of(reading.program.remarks, &Remark::unread));
}

TEST_CASE("large and deeply nested inputs are read in bounded time") {
  std::string data = "DECL POS TAB[9999]\n", lines;
  for (int i = 1; i <= 5000; ++i) {
    data += fmt::format("TAB[{}]={{X 1,Y 0,Z 0,A 0,B 0,C {}}}\n", i, i);
    lines += "LIN TAB[I]\n";
  }
  const Reading many = Weld(lines, data);
  CHECK_THAT(many.program.points.at(7).untouchable, Catch::Contains("too many"));
  const Reading deep = Weld("", "DECL POS P=" + std::string(100000, '{') + "\n");
  CHECK_FALSE(deep.program.remarks.empty());
  CHECK(Weld(std::string(100000, '(') + "\n").program.points.empty());
}

}  // namespace plumbline::krl_test
