// Plausibility checks of a cell against the arm's own size and masses.
#include "app/base/config/arm_size.h"

#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>

#include "app/base/config/cell_reader.h"
#include "app/base/config/daemon_config_reader.h"
#include "drivers/files/text_file.h"
#include "tests/app/base/config/wrong_line.h"

namespace plumbline::arm_size_test {

using namespace plumbline::config;

namespace {

std::string Ur10() {
  const Result<std::string> text = files::ReadTextFile("config/cells/ur10.toml");
  REQUIRE(text);
  return text.value();
}

/// `text` with what first stands after `from` replaced.
std::string Changed(std::string text, const std::string& from, const std::string& old,
                    const std::string& value) {
  const auto at = text.find(old, text.find(from));
  REQUIRE(at != std::string::npos);
  return text.replace(at, old.size(), value);
}

/// A UR10 with compliances of this class, as size 32 and 40 strain wave gears have them.
std::string SoftUr10() {
  std::string text = Ur10();
  const char* const compliances[] = {"9e-6", "9e-6", "1.2e-5", "3e-5", "3e-5", "6e-5"};
  std::size_t at = 0;
  for (const char* compliance : compliances) {
    at = text.find("link_com_mm", at);
    REQUIRE(at != std::string::npos);
    const std::string line = fmt::format("compliance_rad_per_Nm = {}\n", compliance);
    text.insert(at, line);
    at += line.size() + 1;
  }
  return text;
}

std::vector<std::string> Warnings(const std::string& cell) {
  FaultList faults;
  CHECK(CellFromText(cell, "cell.toml", faults));
  return Texts(faults, Fault::Severity::kWarning);
}

TEST_CASE("The ready arms are of a plausible size, and rated near what their makers say") {
  // Rated payloads by the makers' data sheets; of those whose link masses are declared.
  const std::pair<const char*, double> arms[] = {
      {"ur5", 5}, {"ur10", 10}, {"iiwa7", 7}, {"xarm6", 5}};
  for (const auto& [name, rated_kg] : arms) {
    FaultList faults;
    const auto cell = ReadCell(fmt::format("config/cells/{}.toml", name), faults);
    REQUIRE(cell);
    const ArmSize size = ArmSizeOf(cell->robot);
    CAPTURE(name, size.reach_m, size.RatedLoad_kg());
    REQUIRE(size.link_torque);
    CHECK(size.RatedLoad_kg() > 0.7 * rated_kg);
    CHECK(size.RatedLoad_kg() < 1.5 * rated_kg);
  }
}

TEST_CASE("Plausible cells have no warning") {
  CHECK(Warnings(Ur10()).empty());
  CHECK(Warnings(SoftUr10()).empty());
}

TEST_CASE("One joint's length in metres is detected by comparison with the other joints") {
  const auto a = Warnings(Changed(Ur10(), "", "a_mm = -572.3", "a_mm = -0.5723"));
  REQUIRE(a.size() == 1);
  CHECK_THAT(
      a[0],
      Catch::Contains("robot.joint[3].a_mm: warning: -0.5723 is less than 2 mm on an arm "
                      "whose longest length is 612 mm; it looks like metres: if so, write -572.3"));
  const auto d = Warnings(Changed(Ur10(), "", "d_mm = 163.941", "d_mm = 0.163941"));
  REQUIRE(d.size() == 1);
  CHECK_THAT(d[0], Catch::Contains("robot.joint[4].d_mm: warning: 0.163941") &&
                       Catch::Contains("write 163.941"));
}

TEST_CASE("A calibrated table with tenths of millimetres in place of zeros has no warning") {
  std::string cell = Ur10();
  cell = Changed(cell, "d_mm = 127.3", "a_mm = -612.0", "a_mm = -612.31");
  const char* const small[] = {"0.31", "-0.12", "0.44"};
  for (const char* value : small) {
    cell = Changed(cell, "[[robot.joint]]", "d_mm = 0.0\n", fmt::format("d_mm = {}\n", value));
    if (cell.find("d_mm = 0.0\n") == std::string::npos) break;
  }
  cell = Changed(cell, "d_mm = 163.941", "a_mm = 0.0", "a_mm = 0.21");
  CHECK(Warnings(cell).empty());
}

TEST_CASE("A centre of mass in metres is detected by comparison with the link's length") {
  const auto warnings = Warnings(
      Changed(Ur10(), "", "link_com_mm = [380.0, 0.0, 158.0]", "link_com_mm = [0.38, 0, 0.158]"));
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0], Catch::Contains("robot.joint[2].link_com_mm: warning: ") &&
                              Catch::Contains("a link of 612 mm within 0.41 mm of its far end; it "
                                              "looks like metres: write [380, 0, 158]"));
}

TEST_CASE("A centre of mass beyond the stretched arm is reported with its distance") {
  const auto warnings = Warnings(Changed(Ur10(), "", "link_com_mm = [380.0, 0.0, 158.0]",
                                         "link_com_mm = [-90000.0, 0.0, 158.0]"));
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0], Catch::Contains("robot.joint[2].link_com_mm: warning: ") &&
                              Catch::Contains("puts the centre of mass 90 m from the frame of its "
                                              "link") &&
                              Catch::Contains("Probably the unit is wrong; write mm"));
}

TEST_CASE("A compliance wrong by a factor of a thousand is detected by its wind-up") {
  for (const std::string key : {"9e-6", "1.2e-5", "3e-5", "6e-5"}) {
    const double value = std::stod(key);
    for (const double factor : {1e3, 1e-3}) {
      const auto warnings =
          Warnings(Changed(SoftUr10(), "", key, fmt::format("{:g}", factor * value)));
      CAPTURE(key, factor, warnings.size());
      REQUIRE(warnings.size() == 1);
      CHECK_THAT(warnings[0], Catch::Contains("compliance_rad_per_Nm: warning: ") &&
                                  Catch::Contains("winds this axis up by") &&
                                  Catch::Contains(factor > 1 ? "too soft" : "too stiff"));
    }
    CHECK(Warnings(Changed(SoftUr10(), "", key, fmt::format("{:g}", 3 * value))).empty());
    CHECK(Warnings(Changed(SoftUr10(), "", key, fmt::format("{:g}", value / 3))).empty());
  }
}

TEST_CASE("Link masses in grams, of one joint or of all, are detected") {
  const auto one = Warnings(Changed(Ur10(), "", "link_mass_kg = 4.27", "link_mass_kg = 4270"));
  REQUIRE(one.size() == 1);
  CHECK_THAT(one[0], Catch::Contains("robot.joint[3].link_mass_kg: warning: 4270") &&
                         Catch::Contains("the mass of all other links") &&
                         Catch::Contains("if it is grams, write 4.27"));
  std::string all = Ur10();
  for (const char* mass : {"7.1", "12.7", "4.27", "2.0", "2.0", "0.365"}) {
    const std::string old = std::string("link_mass_kg = ") + mass + "\n";
    all = Changed(all, "", old, fmt::format("link_mass_kg = {:g}\n", 1e-3 * std::stod(mass)));
  }
  const auto light = Warnings(all);
  REQUIRE(light.size() == 1);
  CHECK_THAT(light[0], Catch::Contains("robot.joint[1].link_mass_kg: warning: ") &&
                           Catch::Contains("arms that reach"));
}

TEST_CASE("A tool several times as long as the arm causes a warning") {
  const auto warnings =
      Warnings(Changed(Ur10(), "", "tcp_mm = [0.0, 0.0, 0.0] ", "tcp_mm = [0.0, 0.0, 6000.0] "));
  CHECK(std::any_of(warnings.begin(), warnings.end(), [](const std::string& text) {
    return text.find(
               "tool.tcp_mm: warning: [0, 0, 6000] gives a tool of 6 m on an arm that reaches ") !=
           std::string::npos;
  }));
}

TEST_CASE(
    "A payload of 60 kg on an arm rated for 10 kg causes a warning; the rated payload does not") {
  const auto check = [](const std::string& payload, const std::string& point) {
    const FileSource files = [](const std::string& path) -> Result<std::string> {
      if (path == "ur10.toml") return Ur10();
      return files::ReadTextFile("config/profiles/universal-robots.toml");
    };
    FaultList faults;
    CHECK(DaemonConfigFromText(
        "cell = \"ur10.toml\"\n[robot]\nprofile = \"universal-robots.toml\"\nhost = "
        "\"10.0.0.2\"\n" +
            payload +
            "[[point]]\nid = 1\nxyz_mm = [700.0, -200.0, 400.0]\nrpy_deg = [180, 0, 0]\n" + point,
        "plumbline.toml", files, "/nonexistent", faults));
    std::string told;
    for (const std::string& text : Texts(faults, Fault::Severity::kWarning)) {
      if (text.find("is rated for") != std::string::npos) told += text + "\n";
    }
    return told;
  };
  const std::string fixed = "[payload]\nsource = \"fixed\"\nmass_kg = ";
  CHECK(check(fixed + "10.0\n", "").empty());
  CHECK_THAT(check(fixed + "60.0\n", ""),
             Catch::Contains("payload.mass_kg: warning: 60 is more than twice the "));
  CHECK_THAT(check(fixed + "5.0\n", "payload_kg = 60.0\n"),
             Catch::Contains("point[1].payload_kg: warning: 60 is more than twice"));
}

TEST_CASE("No measured cell causes a false warning about its size", "[measured]") {
  const char* given = std::getenv("PLUMBLINE_MEASURED");
  const std::filesystem::path measured = given != nullptr ? given : "../shared/measured";
  if (!std::filesystem::is_directory(measured)) {
    WARN("SKIPPED: no folder " << measured.string() << "; set PLUMBLINE_MEASURED");
    return;
  }
  for (const auto& entry : std::filesystem::directory_iterator(measured)) {
    const auto file = entry.path() / "cell.toml";
    if (!std::filesystem::exists(file)) continue;
    FaultList faults;
    const auto cell = ReadCell(file.string(), faults);
    CAPTURE(file.string(), FaultsText(faults));
    if (!cell) continue;  // of another schema; ready_cells_test says so
    for (const Fault& fault : faults.All()) {
      const bool of_size = fault.what.find("looks like") != std::string::npos ||
                           fault.what.find("radians") != std::string::npos ||
                           fault.what.find("winds this axis") != std::string::npos ||
                           fault.key.find("link_mass_kg") != std::string::npos ||
                           fault.what.find("gives a tool") != std::string::npos;
      CHECK_FALSE(of_size);
    }
  }
}

}  // namespace
}  // namespace plumbline::arm_size_test
