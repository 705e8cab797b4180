// The RAPID grammar, construct by construct.
#include "app/programs/brands/rapid.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "app/programs/flow/flow.h"

namespace rapid_test {

using namespace plumbline;
using namespace plumbline::programs;
using Catch::Contains;
using Catch::Matchers::WithinAbs;

namespace {

constexpr const char* kTail = ",[0,0,1,0],[0,-1,0,1],[9E9,9E+09,9E+9,9E9,9E9,9E9]]";

std::string RobTarget(const std::string& position) {
  return "[[" + position + "]" + kTail;
}

/// A module with tools, work objects, a load and three points.
std::string Module(const std::string& body, const std::string& declarations = "") {
  return "MODULE M\n"
         "PERS tooldata tGrip:=[TRUE,[[0,10,200],[1,0,0,0]],[5,[1,2,100],[1,0,0,0],0,0,0]];\n"
         "PERS tooldata tFix:=[FALSE,[[0,0,200],[1,0,0,0]],[5,[0,0,9],[1,0,0,0],0,0,0]];\n"
         "PERS wobjdata wTable:=[FALSE,TRUE,\"\",[[500,0,0],[0.7071068,0,0,0.7071068]],"
         "[[10,0,0],[1,0,0,0]]];\n"
         "PERS wobjdata wTurn:=[FALSE,FALSE,\"STN1\",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\n"
         "PERS loaddata lPart:=[3,[0,0,50],[1,0,0,0],0,0,0];\n"
         "CONST robtarget p10:=" +
         RobTarget("600,0,800") +
         ";\nlocal const robtarget p20 := " + RobTarget("600, -1.5, +8E2") +
         ";\ntask pers robtarget p30:=" + RobTarget("1,2,3") + ";\n" + declarations + body +
         "ENDMODULE\n";
}

std::string Main(const std::string& statements) {
  return "PROC main()\n" + statements + "ENDPROC\n";
}

Program Read(const std::string& bytes) {
  return Rapid().Read({{"m.mod", bytes}}).program;
}

std::vector<Step> StepsOf(const Program& program, StepKind kind) {
  std::vector<Step> steps;
  for (const Routine& routine : program.routines) {
    for (const Step& step : routine.steps) {
      if (step.kind == kind) steps.push_back(step);
    }
  }
  return steps;
}

std::vector<Motion> MotionsOf(const Program& program) {
  std::vector<Motion> motions;
  for (const Step& step : StepsOf(program, StepKind::kMotion)) motions.push_back(step.motion);
  return motions;
}

std::string EndOf(const Program& program, const Motion& motion) {
  return motion.end.point ? program.points[*motion.end.point].name : motion.end.computed;
}

/// Names of the points at which the motions end, with a blank between.
std::string EndsOf(const Program& program) {
  std::string ends;
  for (const Motion& motion : MotionsOf(program)) ends += EndOf(program, motion) + " ";
  return ends;
}

std::string ReasonFor(const Program& program, const std::string& point) {
  for (const Step& step : StepsOf(program, StepKind::kUse)) {
    if (program.points[*step.point].name == point) return step.reason;
  }
  return "";
}

}  // namespace

TEST_CASE("a robtarget has the place of each of its numbers, its confdata and its axes in use") {
  const std::string bytes = Module("",
                                   "CONST robtarget q:=[[1,2,3],[0,0,-1,0],[ -1 ,0,0,4],"
                                   "[-0.0053,14350,9E+09,9E9,9E9,9E9]];\n");
  const Program program = Read(bytes);
  REQUIRE(program.points.size() == 4);
  const Point& point = program.points[1];
  CHECK(point.name == "p20");
  CHECK(point.place.line == 8);
  REQUIRE(point.numbers.size() == 7);
  const Span& z = point.numbers[2]->span;
  CHECK(bytes.substr(z.begin, z.end - z.begin) == "+8E2");
  CHECK(point.numbers[2]->value == 800);
  CHECK(point.numbers[1]->value == -1.5);
  REQUIRE(point.configuration.fields.size() == 4);
  CHECK(point.configuration.fields[1].key == "cf4");
  CHECK(point.configuration.fields[1].text == "-1");
  CHECK(point.external_axes.empty());
  const Point& q = program.points[3];
  CHECK(q.configuration.fields[0].text == "-1");
  REQUIRE(q.external_axes.size() == 2);
  CHECK(q.external_axes[1]->value == 14350);
}

TEST_CASE("a motion has the tool and the work object of its own line") {
  const Program program =
      Read(Module(Main("MoveJ p10,v100,z10,tGrip\\WObj:=wTable;\nMOVEL p20,v100,fine,tGrip;\n"
                       "MoveC p10,p30,v100,z5,tool0;\nMoveL p10\\ID:=5,v1\\T:=3,fine\\Inpos:=i,"
                       "tElsewhere\\WObj:=wTurn;\n")));
  const auto motions = MotionsOf(program);
  REQUIRE(motions.size() == 4);
  CHECK(motions[0].tool->key == "tGrip");
  CHECK(motions[0].base->key == "wTable");
  CHECK(motions[0].passes_by);
  CHECK(motions[1].kind == MotionKind::kLinear);
  CHECK(motions[1].base->key == "wobj0");
  CHECK_FALSE(motions[1].passes_by);
  CHECK(motions[2].kind == MotionKind::kCircular);
  CHECK(motions[2].via->point == 0U);
  CHECK(motions[2].end.point == 2U);
  CHECK(motions[3].tool->key == "tElsewhere");
  CHECK(program.tools.count("tElsewhere") == 0);
  CHECK_THAT(program.bases.at("wTurn").changes, Contains("STN1"));
  const Pose& X = program.bases.at("wTable").X;
  CHECK_THAT(X.p.x(), WithinAbs(0.5, 1e-12));
  CHECK_THAT(X.p.y(), WithinAbs(0.01, 1e-9));
  const FrameValue& tool = program.tools.at("tGrip");
  CHECK_THAT(tool.X.p.z(), WithinAbs(0.2, 1e-12));
  CHECK(tool.load->mass_kg == 5);
  CHECK_THAT(tool.load->cog_F.y(), WithinAbs(0.002, 1e-12));
  CHECK_FALSE(tool.load->cog_in_tool);
}

TEST_CASE("a payload is gripped and released, and lies in the tool frame") {
  const Program program = Read(Module(Main("GripLoad lPart;\nGripLoad load0;\n")));
  const auto steps = StepsOf(program, StepKind::kSetExtra);
  REQUIRE(steps.size() == 3);
  CHECK(steps[0].setting == Setting{});  // where main starts
  CHECK(steps[1].setting.key == "lPart");
  CHECK(steps[2].setting == Setting{});
  CHECK(program.loads.at("lPart").mass_kg == 3);
  CHECK(program.loads.at("lPart").cog_in_tool);
}

TEST_CASE("instructions of the options are motions, some of them special") {
  const Program program = Read(Module(
      Main("ArcLStart p10,v100,sm1,wd1,fine,tGrip\\WObj:=wTable\\SeamName:=\"a,b;!c\";\n"
           "ArcL p20,v100,sm1,wd1\\Weave:=wv1,z1,tGrip;\nArcC p10,p20,v100,sm1,wd1,z1,tGrip;\n"
           "TriggL p10,v100,tr1,z10,tGrip;\nMoveLDO p10,v100,z10,tGrip\\WObj:=wTable,do1,1;\n"
           "SpotL p10,v100,sp1,gun1,tGrip;\nSearchL\\Stop,di1,p30,p20,v10,tGrip;\n"
           "MoveL p10,v1,fine,tFix;\nEGMMoveL id1,p10,v1,fine,tGrip;\nMoveL "
           "p10,v1,fine,tGrip\\Corr;\n")));
  const auto motions = MotionsOf(program);
  REQUIRE(motions.size() == 10);
  for (std::size_t i = 0; i < 7; ++i) CHECK(motions[i].tool->key == "tGrip");
  CHECK(motions[0].special.empty());
  CHECK(motions[1].special.empty());  // weaving rides on the path
  CHECK(motions[2].kind == MotionKind::kCircular);
  CHECK(motions[4].base->key == "wTable");
  CHECK_THAT(motions[6].special, Contains("search"));
  CHECK_THAT(ReasonFor(program, "p30"), Contains("search"));
  CHECK_THAT(motions[7].special, Contains("stationary"));
  CHECK_FALSE(motions[8].special.empty());
  CHECK_FALSE(motions[9].special.empty());
}

TEST_CASE("Offs and RelTool with constants are offsets, others are not known") {
  const Program program = Read(Module(
      Main(
          "MoveL Offs(p10,0,h/2,-(h+1)),v1,fine,tGrip;\nMoveL RelTool(p10,0,0,5\\Rz:=90),v1,fine,"
          "tGrip;\nMoveL Offs(p10,0,0,n),v1,fine,tGrip;\nMoveL Offs(Offs(p10,1,0,0),1,0,0),v1,fine,"
          "tGrip;\nMoveL RelTool(p10,0,0,5\\Rx:=1\\Rz:=90),v1,fine,tGrip;\n"),
      "CONST num h:=100;\nVAR num n:=5;\n"));
  const auto motions = MotionsOf(program);
  REQUIRE(motions.size() == 5);
  CHECK(motions[0].end.offset.in == Offset::In::kBase);
  CHECK_THAT(motions[0].end.offset.X.p.y(), WithinAbs(0.05, 1e-12));
  CHECK_THAT(motions[0].end.offset.X.p.z(), WithinAbs(-0.101, 1e-12));
  CHECK(motions[1].end.offset.in == Offset::In::kTool);
  CHECK_THAT(motions[1].end.offset.X.R(1, 0), WithinAbs(1, 1e-12));
  CHECK_FALSE(motions[2].end.offset.unknown.empty());
  CHECK_THAT(motions[3].end.offset.X.p.x(), WithinAbs(0.002, 1e-12));
  CHECK_FALSE(motions[4].end.offset.unknown.empty());  // in which order is not known
}

TEST_CASE("a motion to a target that no file declares asks for the module") {
  const auto motions = MotionsOf(Read(Module(Main("MoveL p99,v100,fine,tool0;\n"))));
  REQUIRE(motions.size() == 1);
  CHECK(motions[0].end.computed == "p99");
  CHECK_THAT(motions[0].end.missing, Contains("give the module"));
}

TEST_CASE("an index that is computed stands for every element") {
  const std::string points = "CONST robtarget a{3}:=[" + RobTarget("1,0,0") + "," +
                             RobTarget("2,0,0") + "," + RobTarget("3,0,0") + "];\n";
  const Program program =
      Read(Module(Main("MoveL a{2},v1,fine,tGrip;\nFOR i FROM 1 TO 3 DO\nMoveJ a{i},v1,z1,tGrip;\n"
                       "ENDFOR\n"),
                  points));
  CHECK(EndsOf(program) == "a{2} a{1} a{2} a{3} ");
}

TEST_CASE("points in records and in records of records are followed by their fields") {
  const std::string records =
      "RECORD job\nnum n;\nrobtarget pick;\nENDRECORD\nRECORD cell\njob first;\nstring "
      "s;\nENDRECORD\n"
      "PERS cell c{2}:=[[[1," +
      RobTarget("1,0,0") + "],\"]\"],[[2," + RobTarget("2,0,0") + "],\"\"]];\nPERS other o:=[" +
      RobTarget("3,0,0") + "];\n";
  const Program program = Read(Module(Main("MoveL c{2}.first.pick,v1,fine,tGrip;\n"), records));
  CHECK(EndsOf(program) == "c{2}.first.pick ");
  REQUIRE(program.points.size() == 6);
  CHECK_THAT(program.points[5].untouchable, Contains("other"));
}

TEST_CASE("a parameter stands for the arguments at each call") {
  const Program program = Read(
      Module(Main("Go p10,v100,tGrip\\WObj:=wTable;\nGo p20,v100,tool0;\nGo "
                  "p10,v5,tGrip\\WObj:=wTable;\n") +
             "PROC Go(robtarget p,speeddata v,PERS tooldata t\\PERS wobjdata WObj)\n"
             "MoveL Offs(p,0,0,100),v,z1,t\\WObj?WObj;\nMoveL p,v,fine,t\\WObj?WObj;\nENDPROC\n"));
  CHECK(program.routines.size() == 3);  // the same arguments share a copy
  const auto motions = MotionsOf(program);
  REQUIRE(motions.size() == 4);
  CHECK(EndsOf(program) == "p10 p10 p20 p20 ");
  CHECK(motions[0].end.offset.in == Offset::In::kBase);
  CHECK(motions[0].base->key == "wTable");
  CHECK(motions[2].tool->key == "tool0");
  CHECK(motions[2].base->key == "wobj0");
  CHECK(StepsOf(program, StepKind::kUse).empty());
}

TEST_CASE("a variable stands for what is assigned to it, a function for what it returns") {
  const Program program = Read(
      Module(Main("goal:=p10;\ngoal:=Offs(p20,0,0,10);\nMoveL goal,v1,fine,tGrip;\nMoveL "
                  "Choose(2),v1,fine,tGrip;\n"
                  "p30.trans.z:=5;\nMoveL p30,v1,fine,tGrip;\nMoveL CRobT(),v1,fine,tGrip;\n") +
                 "FUNC robtarget Choose(num n)\nIF n=1 RETURN p10;\nRETURN p20;\nENDFUNC\n",
             "VAR robtarget goal;\n"));
  CHECK(EndsOf(program) == "p10 p20 p10 p20 p30 CRobT() ");
  const auto motions = MotionsOf(program);
  CHECK(motions[1].end.offset.in == Offset::In::kBase);
  CHECK_FALSE(motions[4].end.offset.unknown.empty());
  CHECK_THAT(program.points[2].untouchable, Contains("m.mod:"));
  CHECK(StepsOf(program, StepKind::kUse).empty());
}

TEST_CASE("a variable that is only moved by itself has no value") {
  const Program program =
      Read(Module(Main("goal:=Offs(goal,1,0,0);\nMoveL Offs(goal,0,0,1),v1,fine,tGrip;\n"),
                  "VAR robtarget goal;\n"));
  const auto motions = MotionsOf(program);
  REQUIRE(motions.size() == 1);
  CHECK_FALSE(motions[0].end.computed.empty());
}

TEST_CASE("what is read of a variable is read of the points that are assigned to it") {
  const Program program = Read(Module(
      Main("goal:=p10;\nx:=goal.trans.x;\nMoveL goal,v1,fine,tGrip;\n"), "VAR robtarget goal;\n"));
  CHECK_THAT(ReasonFor(program, "p10"), Contains("calculation"));
}

TEST_CASE("points that are read or handed to unknown routines are used otherwise") {
  const Program program = Read(Module(
      Main("x:=p10.trans.x;\nGlue p20,v100,tGrip;\nIF Distance(p30.trans,q)>5 THEN\nENDIF\n")));
  CHECK_THAT(ReasonFor(program, "p10"), Contains("calculation"));
  CHECK_THAT(ReasonFor(program, "p20"), Contains("Glue"));
  CHECK_FALSE(ReasonFor(program, "p30").empty());
  CHECK(StepsOf(program, StepKind::kCall).size() == 1);
  REQUIRE(program.remarks.size() == 1);
  CHECK_THAT(program.remarks[0].text, Contains("Glue"));
}

TEST_CASE("tools and work objects that change at run time say where") {
  const Program program = Read(
      Module(Main("wTable.oframe.trans:=x;\ntGrip:=tFix;\nMoveL p10,v1,fine,tGrip\\WObj:=wTable;\n"
                  "SetMass tFix;\nMoveL p10,v1,fine,tFix;\n") +
             "PROC SetMass(INOUT tooldata t)\nt.tload.mass:=3;\nENDPROC\n"));
  CHECK_THAT(program.bases.at("wTable").changes, Contains("m.mod:11"));
  CHECK_THAT(program.tools.at("tGrip").changes, Contains("m.mod:12"));
  CHECK_THAT(program.tools.at("tFix").changes, Contains("SetMass"));
}

TEST_CASE("displacements hold until they are switched off") {
  const Program program =
      Read(Module(Main("PDispOn\\ExeP:=p10,p20,tGrip;\nMoveL p30,v1,fine,tGrip;\nPDispOff;\n")));
  const auto shifts = StepsOf(program, StepKind::kShift);
  REQUIRE(shifts.size() == 3);
  CHECK(shifts[0].setting.unknown.empty());  // where main starts
  CHECK_THAT(shifts[1].setting.unknown, Contains("PDispOn"));
  CHECK(shifts[2].setting.unknown.empty());
  CHECK_FALSE(ReasonFor(program, "p10").empty());
  CHECK_FALSE(ReasonFor(program, "p20").empty());
  const Program both = Read(Module(Main("PDispSet d;\nEOffsOn p10;\nPDispOff;\n")));
  CHECK_FALSE(StepsOf(both, StepKind::kShift).back().setting.unknown.empty());
  const Program soft = Read(Module(Main("SoftAct 3,20;\nPDispSet d;\nSoftDeact;\n")));
  CHECK_THAT(StepsOf(soft, StepKind::kShift).back().setting.unknown, Contains("PDispSet"));
}

TEST_CASE("a stated posture is not obeyed after ConfJ or ConfL switches it off") {
  const auto ignored = [](const std::string& statements) {
    const Program program = Read(Module(Main(statements)));
    std::string text;
    for (const MotionAt& at : FlowOf(program, {}).motions) {
      const bool joint = at.motion->kind == MotionKind::kJoint;
      text += at[joint ? Slot::kObeyJoint : Slot::kObeyLinear].key.empty() ? "0" : "1";
    }
    return text;
  };
  const std::string j = "MoveJ p10,v1,fine,tGrip;\n", l = "MoveL p10,v1,fine,tGrip;\n";
  CHECK(ignored(j + l) == "00");
  CHECK(ignored("ConfJ\\Off;\n" + j + l) == "10");
  CHECK(ignored(l + "ConfL \\Off;\n" + j + l + "ConfL\\On;\n" + l) == "0010");
  CHECK(ignored("Sub;\n" + l + "ENDPROC\nPROC Sub()\nConfL\\Off;\n") == "1");
}

TEST_CASE("blocks become branches, and every label exists") {
  const Program program = Read(Module(Main(
      "again:\nIF a=1 AND (b OR c{1}.d=\"THEN\") THEN\nMoveL p10,v1,fine,tGrip;\nELSEIF e THEN\n"
      "ELSE\nGOTO again;\nENDIF\nIF di1=1 MoveL p20,v1,fine,tGrip;\nIF x GOTO nowhere;\nWHILE n<5 "
      "DO\n"
      "TEST n\nCASE 1,2:\nMoveL p30,v1,fine,tGrip;\nCASE 3:\nRETURN;\nDEFAULT:\nEXIT;\nENDTEST\n"
      "ENDWHILE\nagain:\nERROR\nIF ERRNO=1 RETRY;\nRAISE;\n")));
  CHECK(EndsOf(program) == "p10 p20 p30 ");
  CHECK(StepsOf(program, StepKind::kUse).empty());
  for (const Routine& routine : program.routines) {
    for (const Step& step : routine.steps) {
      if (step.kind != StepKind::kJump && step.kind != StepKind::kBranch) continue;
      const auto labelled =
          std::count_if(routine.steps.begin(), routine.steps.end(), [&](const Step& other) {
            return other.kind == StepKind::kLabel && other.label == step.label;
          });
      CHECK(labelled == 1);
    }
  }
  // A motion behind a condition without THEN has no place for further ones.
  const auto motions = MotionsOf(program);
  CHECK(motions[0].statement.end > motions[0].statement.begin);
  CHECK(motions[1].statement.end == motions[1].statement.begin);
}

TEST_CASE("a name made at run time calls what it may call, or what is not given") {
  const Program program = Read(Module(Main("%\"part\"+ValToStr(n)%;\n") +
                                      "PROC Part1()\nMoveL p10,v1,fine,tGrip;\nENDPROC\n"
                                      "PROC Other()\nENDPROC\nTRAP t1\nENDTRAP\n"));
  const auto calls = StepsOf(program, StepKind::kCall);
  REQUIRE(calls.size() == 2);
  CHECK(calls[0].label == "Part1");
  CHECK_THAT(calls[1].label, Contains("ValToStr"));
  int starts = 0;
  for (const Routine& routine : program.routines) starts += routine.starts;
  CHECK(starts == 3);  // main, the trap and what nobody calls
}

TEST_CASE("joint targets, the header, comments and strings are told apart") {
  const Program program = Read(
      "%%%\r\n  VERSION:1\r\n  LANGUAGE:ENGLISH\r\n%%%\r\nMODULE M(SYSMODULE,NOSTEPIN)\r\n"
      "! CONST robtarget c:=[[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\r\n"
      "CONST string s:=\"[[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]\"\"!\";\r\n"
      "PROC main()\r\n"
      "MoveAbsJ [[0,-10,20,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]]\\NoEOffs,v100,fine,tool0;\xE4\r\n"
      "ENDPROC\r\nENDMODULE");
  REQUIRE(program.points.size() == 1);
  CHECK(program.points[0].kind == PointKind::kJoints);
  CHECK(program.points[0].place.line == 9);
  CHECK(program.points[0].numbers.size() == 6);
  CHECK(program.points[0].configuration.fields.empty());
}

TEST_CASE("points whose numbers are no pose stay as they are") {
  const Program program =
      Read(Module("",
                  "CONST robtarget z:=[[0,0,0],[0,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n"
                  "CONST robtarget e:=[[x,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n"));
  REQUIRE(program.points.size() == 5);
  CHECK_THAT(program.points[3].untouchable, Contains("rotation"));
  CHECK_FALSE(program.points[4].untouchable.empty());
}

TEST_CASE("modules are recognised by their words, encoded ones are refused") {
  const Brand& brand = Rapid();
  CHECK(brand.Recognises({"a.mod", "! x\nmodule a\nendmodule"}));
  CHECK(brand.Recognises({"a.txt", "%%%\n VERSION:1\n%%%\nMODULE a\nENDMODULE\n"}));
  CHECK(brand.Recognises({"A.PGF", "<?xml?><Program><Module>a.mod</Module></Program>"}));
  CHECK_FALSE(brand.Recognises({"go.mod", "module example.com/x\n\ngo 1.20\n"}));
  const std::string encoded("\x01\x02\x00zz", 5);
  CHECK(brand.Recognises({"a.MOD", encoded}));
  CHECK_FALSE(brand.Recognises({"a.bin", encoded}));
  const Reading reading = brand.Read({{"a.mod", encoded}});
  REQUIRE(reading.refusals.size() == 1);
  CHECK(reading.program.points.empty());
  CHECK_FALSE(brand.Mark({"a.mod", encoded}, "x"));
}

TEST_CASE("a program list names the modules that are missing") {
  const Reading reading = Rapid().Read(
      {{"a.pgf", "<Program>\n<Module>m.mod</Module>\n<Module>n.mod</Module>\n</Program>"},
       {"m.mod", "MODULE m\nENDMODULE\n"}});
  REQUIRE(reading.program.remarks.size() == 1);
  CHECK(reading.program.remarks[0].place.line == 3);
  CHECK_THAT(reading.program.remarks[0].text, Contains("n.mod"));
}

TEST_CASE("the mark is a comment behind MODULE, and is found again") {
  const SourceFile file{"m.mod", "MODULE M(NOVIEW,\r\n NOSTEPIN)\r\nENDMODULE\r\n"};
  const auto insertion = Rapid().Mark(file, "corrected 5");
  REQUIRE(insertion);
  std::string bytes = file.bytes;
  bytes.insert(insertion->at, insertion->text);
  CHECK(bytes == "MODULE M(NOVIEW,\r\n NOSTEPIN)\r\n  ! Plumbline: corrected 5\r\nENDMODULE\r\n");
  CHECK(Read(bytes).marks.at(0) == "corrected 5");
  CHECK(Read(file.bytes).marks.at(0).empty());
}

TEST_CASE("a quaternion keeps its sign and becomes a unit one") {
  const Conventions& conventions = Rapid().conventions();
  const std::vector<double> old{-0.36, 0, -0.48, -0.8};
  const auto R = conventions.rotation(old);
  REQUIRE(R);
  const auto numbers = conventions.numbers(*R, old);
  for (std::size_t i = 0; i < 4; ++i) CHECK_THAT(numbers[i], WithinAbs(old[i], 1e-12));
  CHECK_FALSE(conventions.rotation(std::vector<double>{0, 0, 0, 0}));
}

TEST_CASE("a further linear or circular motion is written as the original") {
  const Program program =
      Read(Module(Main("  MoveL p10, v100, z10, tGrip\\WObj:=wTable;\nMoveC p10,p20,v1,z1,tGrip;\n"
                       "MoveJ p10,v1,fine,tGrip;\n")));
  const auto motions = MotionsOf(program);
  const std::vector<double> one{1.5, 0, -2, 1, 0, 0, 0};
  CHECK(Rapid().InsertedMotion(program, motions[0], one, 0.1) ==
        "MoveL [[1.5,0,-2],[1,0,0,0],[0,-1,0,1],[9E9,9E+09,9E+9,9E9,9E9,9E9]], v100, z10, "
        "tGrip\\WObj:=wTable;\n  ");
  std::vector<double> two = one;
  two.insert(two.end(), {9, 9, 9, 1, 0, 0, 0});
  const auto circle = Rapid().InsertedMotion(program, motions[1], two, 0.1);
  REQUIRE(circle);
  CHECK_THAT(*circle, Contains("MoveC [[1.5,0,-2],") && Contains(",[[9,9,9],"));
  CHECK_FALSE(Rapid().InsertedMotion(program, motions[2], one, 0.1));
}

TEST_CASE("hostile nesting and repetition are read in bounded time") {
  const auto repeated = [](const std::string& text, int times) {
    std::string all;
    for (int i = 0; i < times; ++i) all += text;
    return all;
  };
  CHECK(Read(Module(Main("x:=" + repeated("[", 200000) + ";\n"))).points.size() == 3);
  CHECK(Read(Module(Main("x:=" + repeated("f(", 100000) + "p10;\n"))).points.size() == 3);
  CHECK(Read(Module(Main("MoveL " + repeated("Offs(", 100000) + "p10;\n"))).points.size() == 3);
  CHECK(Read(Module(Main("x:=" + repeated("a{", 100000) + "1;\n"))).points.size() == 3);
  CHECK(Read(Module(Main(repeated("IF a ", 100000) + "\n"))).points.size() == 3);
  CHECK(Read(Module(Main(repeated("IF a THEN\n", 100000)))).points.size() == 3);
  // Every level calls twice with arguments of its own: 2^40 different calls.
  const Program deep =
      Read(Module(Main("Split p10,1;\n") +
                  "PROC Split(robtarget p,num n)\nMoveL p,v1,fine,tGrip;\n"
                  "Split Offs(p,n,0,0),n+1;\nSplit Offs(p,0,n,0),n*2;\nENDPROC\n"));
  CHECK(deep.routines.size() <= 10000);
  CHECK_FALSE(ReasonFor(deep, "p10").empty());
}

}  // namespace rapid_test
