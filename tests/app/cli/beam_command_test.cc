#include <fmt/format.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "app/base/text/json_text.h"
#include "app/cli/beam_options.h"
#include "app/cli/commands.h"
#include "drivers/files/text_file.h"
#include "tests/app/cli/run_command.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::beam_command_test {

using namespace plumbline::cli;
using namespace plumbline::test;

namespace {

Answer RunBeam(const std::string& arguments) {
  return RunCommand(AddBeamCommand, "beam " + arguments);
}

const std::string kPaper =
    "--length-mm 1800 --section rectangle --b-mm 50 --h-mm 50 --youngs-modulus-gpa 200 "
    "--elements 3 ";

}  // namespace

TEST_CASE("a load series of the paper's beam") {
  SECTION("as a table") {
    const Answer answer = RunBeam(kPaper + "--force-n 100,1000");
    CHECK(answer.exit_code == 0);
    CHECK(answer.err.empty());
    for (const char* value : {"0.2765", "0.9677", "1.8662", "18.6624"}) {
      CHECK_THAT(answer.out, Catch::Contains(value));
    }
  }
  SECTION("as CSV") {
    const Answer answer = RunBeam(kPaper + "--force-n -100 --stress --csv");
    std::istringstream lines(answer.out);
    std::string line;
    std::getline(lines, line);
    CHECK(line ==
          "force_N,node,z_mm,displacement_mm,slope_mrad,moment_Nm,shear_N,normal_MPa,shear_MPa,"
          "von_mises_MPa");
    std::getline(lines, line);
    CHECK_THAT(line, Catch::StartsWith("-100,1,0,0,0,-180,-100,8.64,"));
    int rows = 1;
    while (std::getline(lines, line)) ++rows;
    CHECK(rows == 4);
    CHECK(answer.exit_code == 0);
  }
  SECTION("as JSON, with a point") {
    const Answer answer =
        RunBeam(kPaper + "--force-n 100:100:300 --point-mm 1200,0 --stress --json");
    const nlohmann::json json = text::JsonOrNull(answer.out);
    REQUIRE(json["cases"].size() == 3);
    const nlohmann::json& first = json["cases"][0];
    CHECK(first["nodes"][2]["displacement_mm"].get<double>() == Approx(0.96768));
    CHECK(first["elements"][1]["angle_mrad"].get<double>() == Approx(1.152));
    CHECK(first["elements"][0]["stress"]["normal_MPa"].get<double>() == Approx(8.64));
    const nlohmann::json& point = first["points"][0];
    CHECK(point["compensated_by_section_mm"][1].get<double>() == Approx(-0.96768));
    CHECK(point["compensated_by_element_angle_mm"][1].get<double>() == Approx(-1.3824));
  }
}

TEST_CASE("loads other than the force") {
  const std::string steel_rod = "--length-mm 1000 --section rod --diameter-mm 40 --material steel ";
  auto tip_mm = [&](const std::string& loads) {
    const nlohmann::json json = text::JsonOrNull(RunBeam(steel_rod + loads + " --json").out);
    return json["cases"][0]["nodes"].back()["displacement_mm"].get<double>();
  };
  CHECK(tip_mm("--own-weight") == Approx(-tip_mm("--acceleration-m-s2 9.80665")));
  CHECK(tip_mm("--own-weight --direction x") == Approx(tip_mm("--own-weight")));
  CHECK(tip_mm("--angular-acceleration-rad-s2 1") < 0);
  CHECK(tip_mm("--moment-nm 10") > 0);
  CHECK(tip_mm("--force-n 10 --at-mm 500") == Approx(tip_mm("--force-n 10") * 2.5 / 8));
  // Beyond the tip: F L^3 / (3 E I) + F e L^2 / (2 E I), the shear and moment of a longer lever.
  CHECK(tip_mm("--force-n 10 --at-mm 1500") == Approx(tip_mm("--force-n 10") * 1.75));
  CHECK(tip_mm("--force-n 10 --at-mm 1500") == Approx(tip_mm("--force-n 10 --moment-nm 5")));
  const Answer beyond = RunBeam(steel_rod + "--force-n 10 --at-mm 1500");
  CHECK_THAT(beyond.out, Catch::Contains("force at 1500 mm, 500 mm beyond the tip"));
}

TEST_CASE(
    "displacement and rotation at the force agree with the closed form, also beyond the tip") {
  // Cantilever of length L with a rigid overhang a, under F at its end and the weight w per length:
  //   theta = F L^2 / (2 E I) + F a L / (E I) + w L^3 / (6 E I)
  //   d     = F (L^3 / 3 + a L^2 + a^2 L) / (E I) + w L^4 / (8 E I) + a w L^3 / (6 E I)
  const double L = 1.0, a = 0.5, F = 80, E = 210e9, r = 0.02;
  const double EI = E * M_PI * std::pow(r, 4) / 4, w = 7850 * M_PI * r * r * 9.80665;
  const std::string rod =
      "--length-mm 1000 --section rod --diameter-mm 40 --youngs-modulus-gpa 210 "
      "--density-kg-m3 7850 --own-weight ";
  const auto at_force = [&](const std::string& options) {
    const nlohmann::json json =
        text::JsonOrNull(RunBeam(rod + "--force-n 80 " + options + " --json").out);
    return json["cases"][0].value("force_point", nlohmann::json());
  };
  for (const char* const direction : {"x", "y"}) {
    CAPTURE(direction);
    const nlohmann::json beyond = at_force(std::string("--at-mm 1500 --direction ") + direction);
    const double theta = F * L * L / (2 * EI) + F * a * L / EI + w * L * L * L / (6 * EI);
    const double d = F * (L * L * L / 3 + a * L * L + a * a * L) / EI +
                     w * std::pow(L, 4) / (8 * EI) + a * w * L * L * L / (6 * EI);
    CHECK(beyond["z_mm"].get<double>() == Approx(1500));
    CHECK(beyond["displacement_mm"].get<double>() == Approx(1e3 * d).epsilon(1e-9));
    CHECK(beyond["slope_mrad"].get<double>() == Approx(1e3 * theta).epsilon(1e-9));
  }
  // On the beam, at b: F b^3 / (3 E I) + w b^2 (6 L^2 - 4 L b + b^2) / (24 E I).
  const double b = 0.7;
  const double d =
      F * b * b * b / (3 * EI) + w * b * b * (6 * L * L - 4 * L * b + b * b) / (24 * EI);
  CHECK(at_force("--at-mm 700")["displacement_mm"].get<double>() == Approx(1e3 * d).epsilon(1e-9));
  CHECK(at_force("").is_null());
  const std::string table = RunBeam(rod + "--force-n 80 --at-mm 1500 --elements 1").out;
  CHECK_THAT(table,
             Catch::Contains("force    1500.0") && Catch::Contains("on the rigid extension"));
  CHECK_THAT(RunBeam(rod + "--at-mm 1500 --force-n 10:10:30").out, Catch::Contains("at force mm"));
  const std::string csv = RunBeam(rod + "--at-mm 700 --force-n 80 --elements 1 --csv").out;
  CHECK_THAT(csv, Catch::Contains(fmt::format("\n80,force,700,{:.4f}", 1e3 * d).substr(0, 18)) &&
                      Catch::EndsWith(",,\n"));
  CHECK_THAT(RunBeam(rod + "--force-n 80 --csv").out, !Catch::Contains("force,7"));
}

TEST_CASE("Table 2 of the paper is printed with the published columns") {
  const Answer answer = RunBeam("--paper-table2");
  CHECK(answer.exit_code == 0);
  for (const char* value : {"1.8662", "18.6624", "17.1270", "1.621", "E = 2 GPa"}) {
    CHECK_THAT(answer.out, Catch::Contains(value));
  }
}

TEST_CASE("a stepped tool comes from a cell") {
  const auto path = std::filesystem::temp_directory_path() /
                    ("plumbline-beam-" + std::to_string(::getpid()) + ".toml");
  std::ofstream(path) << R"(schema = 1
[robot]
name = "one"
convention = "dh"
gravity_m_s2 = [0, 0, -9.8]
[[robot.joint]]
a_mm = 0
alpha_deg = 0
d_mm = 100
[tool]
model = "timoshenko"
[[tool.segment]]
length_mm = 400
section = "rod"
diameter_mm = 40
material = "steel"
[[tool.segment]]
length_mm = 300
area_mm2 = 500
ix_mm4 = 30000
iy_mm4 = 20000
material = "aluminium"
)";
  const Answer answer = RunBeam("--cell " + path.string() + " --force-n 50 --elements 2 --stress");
  const Answer both = RunBeam("--cell " + path.string() + " --force-n 50 --section rod");
  std::filesystem::remove(path);
  CHECK(answer.exit_code == 0);
  CHECK_THAT(answer.out, Catch::Contains("Timoshenko, 4 elements"));
  CHECK_THAT(answer.out, Catch::Contains("unknown"));
  CHECK_THAT(answer.out, Catch::Contains("among the elements whose stress is known"));
  CHECK(both.exit_code == 2);
  CHECK_THAT(both.err, Catch::Contains("--cell") && Catch::Contains("--section"));
}

TEST_CASE("each wrong argument has its message and exit code 2") {
  struct Wrong {
    std::string arguments;
    const char* place;
    const char* told;
  };
  const std::string rod = "--length-mm 500 --section rod --diameter-mm 20 --material steel ";
  const Wrong wrong[] = {
      {rod, "the beam has no load", "--force-n"},
      {rod + "--force-n abc", "--force-n", "\"abc\" is not a list of numbers"},
      {rod + "--force-n 1,,2", "--force-n", "\"1,,2\" is not a list of numbers"},
      {rod + "--force-n 1:2", "--force-n", "FIRST:STEP:LAST"},
      {rod + "--force-n 1:0:5", "--force-n", "does not lead"},
      {rod + "--force-n 1:-1:5", "--force-n", "does not lead"},
      {rod + "--force-n 0:0.001:1000", "--force-n", "at most 10000"},
      {rod + "--force-n nan", "--force-n", "not a list of numbers"},
      {rod + "--force-n 1e308", "--force-n", "not a list of numbers"},
      {rod + "--force-n 1 --moment-nm nan", "--moment-nm", "nan is not a number from"},
      {rod + "--moment-nm 1e308", "--moment-nm", "1e308 is not a number from"},
      {rod + "--acceleration-m-s2 inf", "--acceleration-m-s2", "inf is not a number from"},
      {rod + "--angular-acceleration-rad-s2 nan", "--angular-acceleration-rad-s2", "nan is not"},
      {rod + "--force-n 1 --at-mm nan", "--at-mm", "nan is not a number from"},
      {rod + "--force-n 1 --density-kg-m3 nan", "--density-kg-m3", "nan is not a number from"},
      {rod + "--force-n 1 --density-kg-m3 1e9", "--density-kg-m3", "outside 0..25000"},
      {rod + "--force-n 1 --point-mm 10,1e308", "--point-mm", "is not Z,Y in mm"},
      {rod + "--force-n 1 --at-mm 0", "--at-mm", "0 is not on the free side of the clamp"},
      {rod + "--force-n 1 --point-mm 100", "--point-mm", "\"100\" is not Z,Y in mm"},
      {rod + "--force-n 1 --point-mm 600,0", "--point-mm", "outside the beam, 0..500 mm"},
      {rod + "--force-n 1 --elements 0", "--elements", "1 to 1000"},
      {rod + "--force-n 1 --direction z", "--direction", "z"},
      {rod + "--force-n 1 --csv --json", "--csv", "--json"},
      {rod + "--force-n 1 --wall-mm 3", "--wall-mm", "does not apply"},
      {"--length-mm -5 --section rod --diameter-mm 20 --material steel --force-n 1", "--length-mm",
       "-5"},
      {"--section rod --diameter-mm 20 --material steel --force-n 1", "--length-mm", "missing"},
      {"--length-mm 500 --material steel --force-n 1", "--section", "missing"},
      {"--length-mm 500 --section rod --diameter-mm 20 --force-n 1", "--youngs-modulus-gpa",
       "or give a --material"},
      {"--length-mm 500 --section rod --diameter-mm 20 --youngs-modulus-gpa 200 --own-weight",
       "--density-kg-m3", "missing"},
      {"--length-mm 500 --section rod --diameter-mm 20 --youngs-modulus-gpa 200 --force-n 1 "
       "--theory timoshenko",
       "--poisson-ratio", "missing"},
      {"--length-mm 500 --section tube --outer-diameter-mm 20 --wall-mm 10 --material steel "
       "--force-n 1",
       "--wall-mm", "too thick"},
      {"--length-mm 500 --section rod --diameter-mm 20 --material mud --force-n 1", "--material",
       "mud"},
      {"--paper-table2 --json", "--paper-table2", "excludes"},
      {"--paper-table2 --length-mm 900", "--paper-table2", "excludes"},
  };
  for (const Wrong& w : wrong) {
    CAPTURE(w.arguments);
    const Answer answer = RunBeam(w.arguments);
    CHECK(answer.exit_code == 2);
    CHECK_THAT(answer.err, Catch::Contains(w.place) && Catch::Contains(w.told));
    CHECK(answer.out.empty());
  }
}

TEST_CASE(
    "a deflection beyond linear theory causes a warning, and the help shows the real limits") {
  const std::string rod =
      "--length-mm 500 --section rod --diameter-mm 10 --material steel --force-n ";
  const Answer large = RunBeam(rod + "10,500");
  CHECK(large.exit_code == 0);
  CHECK_THAT(large.err, Catch::Contains("warning: at 500 N the tip moves by ") &&
                            Catch::Contains("linear theory is valid up to"));
  CHECK(RunBeam(rod + "10").err.empty());
  CHECK_THAT(
      RunBeam(rod + "10 --yield-mpa 40").err,
      Catch::Contains("at 10 N the stress is ") && Catch::Contains("% of the yield strength"));
  CHECK(RunBeam(rod + "10 --yield-mpa 400").err.empty());
  const std::string help = RunBeam("--help").out;
  CHECK_THAT(help, Catch::Contains("[1..20000]") && !Catch::Contains("1e+17"));
  CHECK_THAT(RunBeam(rod + "1 --wall-mm inf").err,
             Catch::Contains("inf is not a number from 0.01 to 10000"));
}

TEST_CASE("a tool of a cell with several is chosen by its number") {
  const TemporaryFolder folder;
  std::string text = files::ReadTextFile("tests/virtual_cell/demo/cockpit-cell.toml").value();
  const auto at = text.find("[tool]");
  REQUIRE(at != std::string::npos);
  text.replace(at, 6,
               "[[tool]]\nnumber = 7\nmodel = \"euler_bernoulli\"\nlength_mm = 500\n"
               "section = \"rod\"\ndiameter_mm = 40\nmaterial = \"steel\"\n\n[[tool]]\nnumber = 4");
  const std::string file = folder.path() + "/cell.toml";
  REQUIRE(files::WriteTextFile(file, text));
  const std::string beam = "--force-n 10 --cell " + file;
  const Answer first = RunBeam(beam);
  CHECK_THAT(first.err, Catch::Contains("tool 7 of 7, 4 (choose with --tool)"));
  CHECK_THAT(first.out, Catch::Contains("0.0 .. 500.0 mm"));
  const Answer second = RunBeam(beam + " --tool 4");
  CHECK_THAT(second.err, Catch::Contains("tool 4 of 7, 4\n"));
  CHECK_THAT(second.out, !Catch::Contains("0.0 .. 500.0 mm"));
  const Answer none = RunBeam(beam + " --tool 5");
  CHECK(none.exit_code == 2);
  CHECK_THAT(none.err, Catch::Contains("--tool 5: is not declared; the cell declares 7, 4"));
  CHECK_THAT(RunBeam("--tool 4 --force-n 1").err,
             Catch::Contains("--tool: chooses a tool of a cell"));
}

TEST_CASE("a faulty, unreadable or rigid cell is a fault of the input: exit code 1") {
  struct Wrong {
    const char* file;
    const char* told;
  };
  const Wrong wrong[] = {
      {"/nonexistent/cell.toml", "cannot be read"},
      {"config/cells/ur10.toml", "has a rigid tool"},
      {"config/plumbline.toml",
       "(cell = \"cells/ur10.toml\"), but a cell (cell.toml) is read here. Give the cell that it "
       "names."},
  };
  for (const Wrong& w : wrong) {
    CAPTURE(w.file);
    const Answer answer = RunBeam("--cell " + std::string(w.file) + " --force-n 1");
    CHECK(answer.exit_code == 1);
    CHECK_THAT(answer.err, Catch::Contains(w.file) && Catch::Contains(w.told));
  }
}

TEST_CASE("force series") {
  CHECK(*ForceSeriesFromText("100:100:300") == std::vector<double>{100, 200, 300});
  CHECK(*ForceSeriesFromText("0:0.1:0.3") == std::vector<double>{0, 0.1, 0.2, 0.1 * 3});
  CHECK(*ForceSeriesFromText("5:-5:-5") == std::vector<double>{5, 0, -5});
  CHECK(*ForceSeriesFromText("7") == std::vector<double>{7});
  CHECK(ForceSeriesFromText("1:2:10")->back() == 9);
}

}  // namespace plumbline::beam_command_test
