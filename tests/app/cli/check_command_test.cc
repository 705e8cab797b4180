#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "app/base/text/json_text.h"
#include "app/cli/commands.h"
#include "tests/app/cell/daemon/demo_config.h"
#include "tests/app/cli/run_command.h"

namespace plumbline::check_command_test {

using namespace plumbline::cli;

namespace {

test::Answer RunCheck(const std::string& arguments) {
  return test::RunCommand(AddCheckCommand, "check " + arguments);
}

/// A temporary file of this process.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& text, const std::string& suffix = ".toml")
      : path_("/tmp/plumbline_check_" + std::to_string(getpid()) + suffix) {
    std::ofstream(path_) << text;
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() { std::remove(path_.c_str()); }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

TEST_CASE("The object table of a configuration is checked with it, including its mesh files") {
  const std::string good =
      "schema = 1\n[[object]]\nnumber = 1\nname = \"part\"\nfile = \"no-such.obj\"\nunit = \"mm\"\n"
      "on = { frame = \"flange\" }\n";
  const auto check = [](const std::string& table, const std::string& name) {
    const TemporaryFile objects(table, "-objects.toml");
    const TemporaryFile file(test::DemoConfig("127.0.0.1:502", "universal-robots-fine") +
                             "\n[overlay]\nobjects = \"" + (name.empty() ? objects.path() : name) +
                             "\"\n");
    return RunCheck(file.path());
  };
  const test::Answer missing_mesh = check(good, "");
  INFO(missing_mesh.out << missing_mesh.err);
  CHECK(missing_mesh.exit_code == 0);
  CHECK(missing_mesh.out.find("no-such.obj of \"part\" cannot be read") != std::string::npos);
  const test::Answer faulty = check(good + "colour = \"red\"\n", "");
  CHECK(faulty.exit_code == 1);
  CHECK(faulty.out.find("-objects.toml:8 object[1].colour") != std::string::npos);
  std::string endless = "[a";
  for (int k = 0; k < 100'000; ++k) endless += ".a";
  const test::Answer deep = check(good + endless + "]\n", "");
  CHECK(deep.exit_code == 1);
  CHECK(deep.out.find("-objects.toml:8: nested more than 32 levels deep") != std::string::npos);
  const test::Answer none = check(good, "/nowhere/objects.toml");
  CHECK(none.exit_code == 1);
  CHECK(none.out.find("/nowhere/objects.toml") != std::string::npos);
}

TEST_CASE("A valid cell: exit code 0 and a summary") {
  const test::Answer answer = RunCheck("config/cells/ur10.toml");
  CHECK(answer.exit_code == 0);
  CHECK(answer.out.find("robot        UR10, 6 joints") != std::string::npos);
  CHECK(answer.out.find("masses       link masses declared: all (28.43 kg)") != std::string::npos);
  CHECK(answer.out.find("compliance   none declared") != std::string::npos);
}

TEST_CASE("A configuration is known by its cell key and checked with its files") {
  const test::Answer answer = RunCheck("config/plumbline.toml");
  CAPTURE(answer.out);
  CHECK(answer.exit_code == 0);
  CHECK(answer.out.find("controller   tcp 192.168.0.2:502, unit id ") != std::string::npos);
  CHECK(answer.out.find("points       1 assembly point, cycle 10 ms, PLC port 502") !=
        std::string::npos);
}

TEST_CASE("Two cameras are listed separately; sharing a device is a fault") {
  const std::string here = std::filesystem::current_path().string() + "/config/";
  std::ifstream shipped("config/plumbline.toml");
  std::string text((std::istreambuf_iterator<char>(shipped)), std::istreambuf_iterator<char>());
  for (const std::string file : {"cells/ur10.toml", "profiles/universal-robots.toml"}) {
    REQUIRE(text.find('"' + file) != std::string::npos);
    text.replace(text.find('"' + file), 1, '"' + here);
  }
  // The shipped file shows one camera; two are written [[camera]].
  for (const std::string header : {"\n[camera", "\n[tags"}) {
    for (std::size_t at = 0; (at = text.find(header, at)) != std::string::npos; at += 3)
      text.insert(at + 1, "# ");
  }
  text +=
      "\n[[camera]]\nname = \"side\"\ndevice = \"A1\"\n[camera.zoom]\nkind = \"v4l2\"\n"
      "[[camera]]\nname = \"rear\"\ndevice = \"B2\"\n[tags]\nfile = \"" +
      here + "bodies.toml\"\n";
  {
    const TemporaryFile file(text);
    const test::Answer good = RunCheck(file.path());
    CAPTURE(good.out);
    CHECK(good.exit_code == 0);
    CHECK(good.out.find("camera side  device A1, zoom by v4l2\n") != std::string::npos);
    CHECK(good.out.find("camera rear  device B2, no zoom\n") != std::string::npos);
  }
  {
    std::string network = text;
    const std::string by_v4l2 = "kind = \"v4l2\"\n[[camera]]";
    network.replace(network.find(by_v4l2), by_v4l2.size(),
                    "kind = \"visca\"\ndevice = \"192.168.1.9\"\n[[camera]]");
    const TemporaryFile file(network);
    CHECK(RunCheck(file.path()).out.find("device A1, zoom by visca at udp://192.168.1.9:52381\n") !=
          std::string::npos);
  }
  const TemporaryFile file(text.replace(text.find("\"B2\""), 4, "\"A1\""));
  const test::Answer faulty = RunCheck(file.path());
  CHECK(faulty.exit_code == 1);
  CHECK(faulty.out.find("camera[2].device: \"A1\" is used for two cameras") != std::string::npos);
}

TEST_CASE(
    "The payload is shown with mass and centre of gravity; one left at the flange is a warning") {
  const std::string here = std::filesystem::current_path().string();
  std::ifstream bare("config/cells/ur10.toml");
  std::string text((std::istreambuf_iterator<char>(bare)), std::istreambuf_iterator<char>());
  const std::string rigid = "model = \"rigid\"\ntcp_mm = [0.0, 0.0, 0.0] ";
  REQUIRE(text.find(rigid) != std::string::npos);
  text.replace(text.find(rigid), rigid.size(),
               "model = \"euler_bernoulli\"\nlength_mm = 600.0\nsection = \"rod\"\n"
               "diameter_mm = 30.0\nmaterial = \"steel\" ");
  const TemporaryFile cell(text, ".cell.toml");
  const TemporaryFile file(
      "cell = \"" + cell.path() + "\"\n[robot]\nprofile = \"" + here +
      "/config/profiles/generic.toml\"\nhost = \"10.0.0.2\"\n[payload]\n"
      "source = \"fixed\"\nmass_kg = 12.5\n[[point]]\nid = 1\nxyz_mm = [9000, 0, "
      "0]\n[[point]]\nid = 2\nxyz_mm = [1.2, 0.1, 0.7]\n");
  const test::Answer answer = RunCheck(file.path());
  CAPTURE(answer.out);
  CHECK(answer.exit_code == 0);
  CHECK(answer.out.find("payload      12.5 kg, centre of gravity (0, 0, 0) mm in the flange frame, "
                        "600 mm from the tool's tip") != std::string::npos);
  CHECK(answer.out.find("payload.cog_mm: warning: [0, 0, 0] is at the flange, but the tool's tip "
                        "is 600 mm away") != std::string::npos);
  CHECK(answer.out.find("point[1].xyz_mm: warning: [9000, 0, 0] is 9 m from the robot's base, out "
                        "of reach of an arm of ") != std::string::npos);
  CHECK(answer.out.find("point[2].xyz_mm: warning: [1.2, 0.1, 0.7] looks like metres") !=
        std::string::npos);
}

namespace points {

/// The demo's points with a payload of the configuration.
std::string WithPayload(const std::string& payload) {
  std::string text = test::DemoConfig("127.0.0.1:502", "universal-robots-fine");
  const auto at = text.find("source = \"robot\"");
  return text.replace(at, text.find('\n', at) - at, payload);
}

TEST_CASE("Each point is computed with its payload: correction, radius, posture, margins") {
  const TemporaryFile file(WithPayload("source = \"fixed\"\nmass_kg = 60.0"));
  const test::Answer answer = RunCheck(file.path());
  CAPTURE(answer.out);
  CHECK(answer.exit_code == 0);
  CHECK_THAT(answer.out,
             Catch::Contains("\npoint name                 payload          correction      95 % "
                             "basis\n") &&
                 Catch::Contains("\n    1 assembly 1           60 kg ") &&
                 Catch::Contains("\n    2 assembly 2           60 kg ") &&
                 Catch::Contains("\n      posture ") && Catch::Contains(" to the limit of q") &&
                 Catch::Contains("smallest singular value 0.") && Catch::Contains(" (limit 0.02)"));
  const auto table = answer.out.find("\npoint name");
  REQUIRE(table != std::string::npos);
  std::istringstream lines(answer.out.substr(table));
  for (std::string line; std::getline(lines, line);) CHECK(line.size() <= 80);

  const auto json = text::JsonOrNull(RunCheck(file.path() + " --json").out);
  REQUIRE(json.at("points").size() == 2);
  const auto& point = json.at("points")[0];
  CHECK(point.at("id") == 1);
  CHECK(point.at("name") == "assembly 1");
  CHECK(point.at("reachable") == true);
  CHECK(point.at("payload_kg") == 60);
  CHECK(point.at("correction_mm") > 5);
  CHECK(point.at("radius_95_mm") > 0);
  CHECK(point.at("radius_basis").is_string());
  CHECK(point.at("posture").at("joints").size() == 6);
  CHECK(point.at("posture").at("singular_value") > 0.02);
  CHECK(point.at("posture").at("limit_joint") >= 1);
}

TEST_CASE("The inputs of a point that no measured row covered are named, with value and range") {
  std::string domain = "\n[domain]\nq_deg = [";
  for (int joint = 0; joint < 6; ++joint) domain += "[-360.0, 360.0], ";
  domain += "]\npayload_kg = [0.0, 40.0]\ntorques_Nm = [\n  [4, -100.0, 800.0],\n]\n";
  const TemporaryFile cell(test::FileText("tests/virtual_cell/demo/cockpit-cell.toml") + domain,
                           ".cell.toml");
  const TemporaryFile file(test::WithLine(WithPayload("source = \"fixed\"\nmass_kg = 60.0"), "",
                                          "cell", '"' + cell.path() + '"'));
  const test::Answer answer = RunCheck(file.path());
  CAPTURE(answer.out);
  CHECK(answer.exit_code == 0);
  CHECK_THAT(answer.out,
             Catch::Contains("point frame  the cell's: base and tip as declared\n") &&
                 Catch::Contains("      outside the measured range: the payload is 60 kg, "
                                 "measured: 0 to 40 kg\n"));
  const auto json = text::JsonOrNull(RunCheck(file.path() + " --json").out);
  CHECK(json.at("points")[0].at("out_of_range") == "the payload is 60 kg, measured: 0 to 40 kg");
  CHECK_THAT(json.at("points")[1].at("out_of_range").get<std::string>(),
             Catch::Contains("; the gravity torque of q4 is -2") &&
                 Catch::Contains(" N m, measured: -100 to 800 N m"));
}

TEST_CASE("A payload known to the robot only is noted; the point is computed without it") {
  const TemporaryFile none(WithPayload("source = \"robot\""));
  const test::Answer answer = RunCheck(none.path());
  CAPTURE(answer.out);
  CHECK_THAT(answer.out, Catch::Contains("    1 assembly 1           no payload ") &&
                             Catch::Contains("The payload is known to the robot only"));
  const TemporaryFile declared(WithPayload("source = \"robot\"\nmass_kg = 60.0"));
  const auto json = text::JsonOrNull(RunCheck(declared.path() + " --json").out);
  REQUIRE(json.at("points").size() == 4);
  CHECK(json.at("points")[0].at("payload_kg") == 0);
  CHECK(json.at("points")[0].at("payload_by_robot") == true);
  CHECK(json.at("points")[1].at("payload_kg") == 60);
  CHECK(json.at("points")[1].at("correction_mm") > json.at("points")[0].at("correction_mm"));
}

TEST_CASE("Each tool of the table is computed; one that is too heavy is a warning, not a fault") {
  const TemporaryFile file(
      WithPayload("source = \"table\"\n[[payload.tool]]\nnumber = 1\nmass_kg = 5.0\n"
                  "[[payload.tool]]\nnumber = 2\nmass_kg = 600.0"));
  const test::Answer answer = RunCheck(file.path());
  CAPTURE(answer.out);
  CHECK(answer.exit_code == 0);
  CHECK_THAT(answer.out, Catch::Contains(" tool 1, 5 kg ") &&
                             Catch::Contains(" tool 2, 600 kg   NONE: correction too large") &&
                             Catch::Contains("point[1].xyz_mm: warning: ") &&
                             Catch::Contains("has no corrected point with tool 2, 600 kg"));
}

}  // namespace points

TEST_CASE("Nothing to correct is a warning, judged by the corrections, not by the keys") {
  const auto checked = [](const std::string& cell_file, bool beam, const char* xyz_mm) {
    std::ifstream in("config/cells/" + cell_file);
    std::string cell{std::istreambuf_iterator<char>(in), {}};
    if (beam) {  // it hangs vertically at the point, so that its weight does not bend it
      cell.replace(cell.find("model = \"rigid\""),
                   cell.find("\n", cell.find("tcp_mm =")) - cell.find("model = \"rigid\""),
                   "model = \"euler_bernoulli\"\nlength_mm = 300.0\nsection = \"square_tube\"\n"
                   "side_mm = 80.0\nwall_mm = 5.0\nmaterial = \"aluminium_6061\"");
      cell.replace(cell.find("cog_mm = [0.0, 0.0, 0.0]"), 24, "cog_mm = [0.0, 0.0, 300.0]");
    }
    const TemporaryFile own(cell, "-cell.toml");
    const TemporaryFile file(
        "cell = \"" + own.path() + "\"\nstate_directory = \"/nonexistent\"\n[robot]\nprofile = \"" +
        std::filesystem::current_path().string() +
        "/config/profiles/generic.toml\"\nhost = \"127.0.0.1\"\n[payload]\nsource = \"fixed\"\n"
        "mass_kg = 5\n[[point]]\nid = 4\nframe = \"base\"\nxyz_mm = " +
        xyz_mm + "\nrpy_deg = [180, 0, 0]\n");
    const test::Answer answer = RunCheck("--json " + file.path());
    INFO(answer.out << answer.err);
    CHECK(answer.exit_code == 0);
    return answer.out;
  };
  using Catch::Contains;
  const auto nothing =
      Contains("nothing is corrected: the largest correction is 0.000 mm (point 4)");
  CHECK_THAT(checked("ur10.toml", false, "[700, -200, 400]"),
             nothing && Contains("The joints are rigid") && Contains("the tool is rigid"));
  CHECK_THAT(
      checked("ur10.toml", true, "[700, -200, 400]"),
      nothing && Contains("The joints are rigid") && Contains("in the direction of gravity"));
  CHECK_THAT(checked("ur10-typical.toml", false, "[700, -200, 400]"),
             !Contains("nothing is corrected"));
  CHECK_THAT(checked("ur10.toml", false, "[7000, -200, 400]"), !Contains("nothing is corrected"));
}

TEST_CASE("A profile and an empty file are recognised") {
  const test::Answer profile = RunCheck("config/profiles/xarm.toml");
  CHECK(profile.exit_code == 1);
  CHECK(profile.out.find("is recognised as a register profile of a robot controller") !=
        std::string::npos);
  const TemporaryFile empty("");
  CHECK(RunCheck(empty.path()).out.find("is empty") != std::string::npos);
}

TEST_CASE("A configuration without its cell key is recognised: only the cell is missing") {
  const TemporaryFile file("[robot]\nprofile = \"" + std::filesystem::current_path().string() +
                           "/config/profiles/generic.toml\"\nhost = \"10.0.0.2\"\n[plc]\n");
  const test::Answer answer = RunCheck(file.path());
  CHECK(answer.exit_code == 1);
  CHECK(answer.out.find("cell: missing; expected a string in quotes\n") != std::string::npos);
  CHECK(answer.out.find("unknown key") == std::string::npos);
}

TEST_CASE("An effect that the daemon cannot apply is a fault of a configuration, not of its cell") {
  const std::string here = std::filesystem::current_path().string();
  std::ifstream bare("config/cells/ur10.toml");
  const std::string text((std::istreambuf_iterator<char>(bare)), std::istreambuf_iterator<char>());
  const TemporaryFile cell(text +
                               "\n[[effect]]\nid = \"approach_lag\"\nparameters = [ { name = "
                               "\"q1\", value = 0.001 } ]\n",
                           ".cell.toml");
  const TemporaryFile file("cell = \"" + cell.path() + "\"\n[robot]\nprofile = \"" + here +
                           "/config/profiles/generic.toml\"\nhost = \"10.0.0.2\"\n");
  const test::Answer answer = RunCheck(file.path());
  CAPTURE(answer.out);
  CHECK(answer.exit_code == 1);
  CHECK(answer.out.find("\"approach_lag\" depends on the robot's last moves") != std::string::npos);
  CHECK(RunCheck(cell.path()).exit_code == 0);
}

TEST_CASE("The table of a replay is checked in the same way as by the daemon") {
  const std::string here = std::filesystem::current_path().string();
  const auto with_table = [&here](const std::string& csv) {
    const TemporaryFile table(csv, ".csv");
    const TemporaryFile file("cell = \"" + here +
                             "/config/cells/ur10.toml\"\n[robot]\nprofile = \"" + here +
                             "/config/profiles/generic.toml\"\ntransport = \"replay\"\n"
                             "replay_file = \"" +
                             table.path() + "\"\n");
    return RunCheck(file.path());
  };
  const std::string header = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n";
  const test::Answer wrong = with_table("a,b\n1,2\n");
  CHECK(wrong.exit_code == 1);
  CHECK(wrong.out.find("q1_deg: missing column") != std::string::npos);
  const test::Answer empty = with_table(header);
  CHECK(empty.exit_code == 1);
  CHECK(empty.out.find(".csv: has no row that can be replayed") != std::string::npos);
  const test::Answer good = with_table(header + "0,0,0,0,0,0\n0,x,0,0,0,0\n");
  CHECK(good.exit_code == 0);
  CHECK(good.out.find(":3 q2_deg: warning: \"x\" is not a number; row not used") !=
        std::string::npos);
}

TEST_CASE("A faulty cell: exit 1, every fault, no summary") {
  const TemporaryFile file("schema = 1\n[robot]\nname = 3\n");
  const test::Answer answer = RunCheck(file.path());
  CHECK(answer.exit_code == 1);
  CHECK(answer.out.find(":3 robot.name: 3 is not a string in quotes\n") != std::string::npos);
  CHECK(answer.out.find(":1 tool: missing; expected the table [tool]\n") != std::string::npos);
  CHECK(answer.out.find("compliance ") == std::string::npos);
}

TEST_CASE("A file that cannot be read: exit 1") {
  const test::Answer answer = RunCheck("/nonexistent/cell.toml");
  CHECK(answer.exit_code == 1);
  CHECK(answer.err ==
        "/nonexistent/cell.toml: cannot be read: No such file or directory; there is no folder "
        "/nonexistent: check the path\n");
  const test::Answer folder = RunCheck("/");
  CHECK(folder.exit_code == 1);
  CHECK(folder.err == "/: cannot be read: Is a directory; it is a folder: name a file in it\n");
}

TEST_CASE("JSON: faults with their place, separate from warnings") {
  const TemporaryFile file("schema = 1\n[robot]\nname = \"\xFF\"\n");
  const auto bad = text::JsonOrNull(RunCheck("--json " + file.path()).out);
  CHECK(bad["good"] == false);
  REQUIRE(bad["faults"].size() == 1);
  CHECK(bad["faults"][0]["line"] == 3);

  const auto good = text::JsonOrNull(RunCheck("--json config/cells/kr210.toml").out);
  CHECK(good["good"] == true);
  CHECK(good["kind"] == "cell");
  CHECK(good["faults"].empty());
  CHECK(good["summary"]["masses"] == "no link masses declared: joint torques are unknown");
}

}  // namespace
}  // namespace plumbline::check_command_test
