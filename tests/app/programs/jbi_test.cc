#include "app/programs/brands/jbi.h"

#include <catch2/catch.hpp>

namespace plumbline::jbi_test {

using namespace plumbline::programs;

std::string JobText(const std::string& positions, const std::string& instructions,
                    const std::string& name = "WELD") {
  return "/JOB\r\n//NAME " + name + "\r\n//POS\r\n///NPOS 3,0,0,1,0,0\r\n" + positions +
         "//INST\r\n///DATE 2024/05/06 07:08\r\n///ATTR SC,RW\r\n///GROUP1 RB1\r\nNOP\r\n" +
         instructions + "END\r\n";
}

const std::string kPositions =
    "///USER 2\r\n///TOOL 1\r\n///POSTYPE USER\r\n///RECTAN\r\n///RCONF 1,0,0,0,0,0,0,0\r\n"
    "C00000=1200.000,-0.500,300.250,180.0000,-5.2500,0.0000\r\n"
    "///TOOL 3\r\n///POSTYPE ROBOT\r\n"
    "C00001=1.000,2.000,3.000,4.0000,5.0000,6.0000\r\n"
    "P00010=0.000,0.000,50.000,0.0000,0.0000,0.0000\r\n";

Program ReadOne(const std::string& positions, const std::string& instructions) {
  return YaskawaJbi().Read({{"WELD.JBI", JobText(positions, instructions)}}).program;
}

std::vector<Step> Steps(const Program& program, StepKind kind) {
  std::vector<Step> found;
  for (const Step& step : program.routines.at(0).steps) {
    if (step.kind == kind) found.push_back(step);
  }
  return found;
}

TEST_CASE("header lines of a job hold for the points that follow them") {
  const Program program =
      ReadOne(kPositions, "MOVL C00000 V=100.0\r\nMOVJ C00001 VJ=50.00 PL=0\r\n");
  REQUIRE(program.points.size() == 3);
  const Point& first = program.points[0];
  const std::string& bytes = program.files[0].bytes;
  CHECK(first.name == "C00000");
  CHECK(first.stated_tool == "TOOL 1");
  CHECK(first.stated_base == "USER 2");
  REQUIRE(first.numbers.size() == 6);
  const Span& y = first.numbers[1]->span;
  CHECK(bytes.substr(y.begin, y.end - y.begin) == "-0.500");
  CHECK(first.configuration.fields.at(0).text == "1,0,0,0,0,0,0,0");
  CHECK(program.points[1].stated_tool == "TOOL 3");
  CHECK(program.points[1].stated_base == "ROBOT");
  CHECK(program.points[2].untouchable.find("position variable") == 0);
  const auto motions = Steps(program, StepKind::kMotion);
  REQUIRE(motions.size() == 2);
  CHECK(motions[0].motion.kind == MotionKind::kLinear);
  CHECK(motions[0].motion.tool->key == "TOOL 1");
  CHECK(motions[0].motion.base->key == "USER 2");
  CHECK(motions[1].motion.end.point == 1U);
  CHECK_FALSE(motions[1].motion.passes_by);
}

TEST_CASE("points in pulses are listed and the job is refused with the way out") {
  const Reading reading = YaskawaJbi().Read(
      {{"P.JBI",
        JobText("///TOOL 0\r\n///POSTYPE PULSE\r\n///PULSE\r\nC00000=-1,-114489,2,3,4,5\r\n",
                "MOVJ C00000 VJ=50.00\r\n")}});
  REQUIRE(reading.refusals.size() == 1);
  CHECK(reading.refusals[0].line == 7);
  CHECK(reading.refusals[0].remedy.find("relative job") != std::string::npos);
  REQUIRE(reading.program.points.size() == 1);
  CHECK_FALSE(reading.program.points[0].untouchable.empty());
}

TEST_CASE("instructions of a job: approximation, searches, shifts, variables, relative motion") {
  const Program program = ReadOne(
      kPositions,
      "MOVL C00000 V=100.0 PL=3  //OUT\r\nMOVL C00000 V=100.0 CR=10.0\r\nMOVC C00001 V=10.0\r\n"
      "MOVL C00001 V=5.0 UNTIL IN#(1)=ON\r\nSFTON P00010\r\nMOVL P00010 V=10.0\r\nSFTOF\r\n"
      "IMOV P00010 V=10.0\r\nCOMM MOVL C00001 V=5.0\r\n'MOVL C00001\r\nSMOVL C00001 V=5.0 +MOVJ "
      "EC00001\r\nREFP 1 C00000\r\n");
  const auto motions = Steps(program, StepKind::kMotion);
  REQUIRE(motions.size() == 7);
  CHECK(motions[0].motion.passes_by);
  CHECK(motions[1].motion.passes_by);
  CHECK(motions[2].motion.kind == MotionKind::kSpline);
  CHECK(motions[3].motion.special.find("search") == 0);
  CHECK(motions[4].motion.end.computed == "P00010");
  CHECK(motions[5].motion.special.find("relative") == 0);
  CHECK(motions[6].motion.special.find("coordinated") == 0);
  const auto shifts = Steps(program, StepKind::kShift);
  REQUIRE(shifts.size() == 2);
  CHECK(shifts[0].setting.unknown == "SFTON P00010");
  CHECK(shifts[1].setting.unknown.empty());
  const auto uses = Steps(program, StepKind::kUse);
  REQUIRE(uses.size() == 1);
  CHECK(uses[0].point == 0U);
  CHECK(program.remarks.size() == 1);
}

TEST_CASE("control flow of a job: calls, jumps, conditions and loops lead to labels that exist") {
  const Program program =
      ReadOne(kPositions,
              "*LOOP\r\nCALL JOB:GRIP IF IN#(1)=ON\r\nJUMP *LOOP IF B001=1\r\nIFTHENEXP B001=1\r\n"
              "PAUSE\r\nELSEIFEXP B001=2\r\nRET IF B002=1\r\nELSE\r\nJUMP *LOOP\r\nENDIF\r\n"
              "WHILEEXP B001=1\r\nENDWHILE\r\nSWITCH B001 CASE 1\r\nCASE 2\r\nENDSWITCH\r\n");
  std::vector<std::string> labels;
  for (const Step& step : Steps(program, StepKind::kLabel)) labels.push_back(step.label);
  for (const StepKind kind : {StepKind::kJump, StepKind::kBranch}) {
    for (const Step& step : Steps(program, kind)) {
      CAPTURE(step.label);
      CHECK(std::count(labels.begin(), labels.end(), step.label) == 1);
    }
  }
  CHECK(Steps(program, StepKind::kCall).at(0).label == "GRIP");
  CHECK(Steps(program, StepKind::kPostureLost).size() == 1);
}

TEST_CASE("TOOL.CND gives the tip, the mass and the centre of gravity of a tool") {
  const std::string tools =
      "//TOOL 0\r\n///NAME STANDARD\r\n0.000,0.000,150.000,0.0000,90.0000,0.0000\r\n"
      "-16.507,-21.039,136.477\r\n104.011\r\n0.000,0.000,0.000\r\n0.000,0,3\r\n"
      "//TOOL 1\r\n///CRC 3243358777\r\n///NAME\r\n0.000,0.000,0.000,0.0000,0.0000,0.0000\r\n"
      "0.000,0.000,0.000\r\n0.000\r\n0.000,0.000,0.000\r\n0.000,0,1\r\n";
  CHECK(YaskawaJbi().Recognises({"TOOL.CND", tools}));
  const Program program =
      YaskawaJbi()
          .Read({{"TOOL.CND", tools}, {"A.JBI", JobText("", "SETTOOL TL#(1) P00010\r\n")}})
          .program;
  REQUIRE(program.tools.size() == 2);
  const FrameValue& tool = program.tools.at("TOOL 0");
  CHECK(tool.X.p.z() == Approx(0.15));
  CHECK(tool.X.R(0, 2) == Approx(1));
  REQUIRE(tool.load);
  CHECK(tool.load->mass_kg == 104.011);
  CHECK(tool.load->cog_F.isApprox(Vec3(-0.016507, -0.021039, 0.136477)));
  REQUIRE(program.tools.at("TOOL 1").load);
  CHECK_FALSE(program.tools.at("TOOL 1").load->mass_kg);
}

TEST_CASE("base axes make the base of a job's points unknown, stations are external axes") {
  const Program program = ReadOne(
      "///TOOL 0\r\n///POSTYPE BASE\r\n///RECTAN\r\n///RCONF 1,0,0,0,0,0\r\n"
      "C00000=1.000,2.000,3.000,4.0000,5.0000,6.0000\r\nBC00000=100.000\r\nEC00000=7\r\n",
      "MOVL C00000 V=1.0\r\n");
  REQUIRE(program.points.size() == 1);
  CHECK(program.points[0].external_axes.size() == 2);
  CHECK_FALSE(Steps(program, StepKind::kMotion).at(0).motion.base->unknown.empty());
}

}  // namespace plumbline::jbi_test
