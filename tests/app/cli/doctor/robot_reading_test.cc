// The doctor's judgement of a robot that answers: the daemon's, with the joints shown.
#include "app/cli/doctor/robot_reading.h"

#include <bit>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <limits>

#include "app/base/config/daemon_config_reader.h"
#include "tests/app/temporary_folder.h"
#include "tests/drivers/robot/fake_controller.h"

namespace plumbline::robot_reading_test {
namespace {

/// A controller with six float32 joints in degrees from register `first` on, read from 0 on.
cli::CheckResult Checked(const std::array<float, 6>& joints_deg, int first = 0,
                         bool low_word_first = false) {
  robot::FakeController controller;
  for (int j = 0; j < 6; ++j) {
    const auto bits = std::bit_cast<std::uint32_t>(joints_deg[static_cast<std::size_t>(j)]);
    const auto high = static_cast<std::uint16_t>(bits >> 16),
               low = static_cast<std::uint16_t>(bits);
    controller.Set(first + 2 * j, low_word_first ? low : high);
    controller.Set(first + 2 * j + 1, low_word_first ? high : low);
  }
  const test::TemporaryFolder folder;
  std::filesystem::copy("config/cells", folder.path() + "/cells");
  std::ofstream(folder.path() + "/p.toml")
      << "schema = 1\nname = \"p\"\nsource = \"test\"\nport = 502\nunit_id = 1\n"
         "[[read]]\ntable = \"holding\"\nfirst = 0\ncount = 12\n"
         "[[joints]]\ntable = \"holding\"\naddress = [0, 2, 4, 6, 8, 10]\ntype = \"float32\"\n"
         "unit = \"deg\"\n";
  const std::string file = folder.path() + "/plumbline.toml";
  std::ofstream(file) << "cell = \"cells/ur10.toml\"\nstate_directory = \"state\"\n[robot]\n"
                      << "profile = \"p.toml\"\nhost = \"127.0.0.1\"\nport = " << controller.port()
                      << "\n[payload]\nsource = \"fixed\"\nmass_kg = 1.0\n";
  config::FaultList faults;
  const auto config = config::ReadDaemonConfig(file, faults);
  INFO(config::FaultsText(faults));
  REQUIRE(config);
  return cli::CheckRobot(*config);
}

constexpr std::array kJoints{12.5F, -95.25F, 88.0F, -61.75F, -90.5F, 170.125F};

}  // namespace

TEST_CASE("a robot that answers is good only if the daemon would trust it") {
  const cli::CheckResult good = Checked(kJoints);
  INFO(good.finding << good.remedy);
  CHECK(good.health == cli::Health::kGood);
  CHECK_THAT(good.finding, Catch::Contains("answers: q1 12.5 deg (-360 to 360), q2 -95.25 deg") &&
                               Catch::Contains("q6 170.125 deg"));
  std::array<float, 6> nan = kJoints, outside = kJoints;
  nan[2] = std::numeric_limits<float>::quiet_NaN();
  outside[1] = 3000;
  for (const auto& [found, why] :
       {std::pair{Checked(kJoints, 0, true), "too small to be readings"},
        {Checked(kJoints, 1), "not trusted"},
        {Checked(nan),
         "not a number. q1 12.5 deg (-360 to 360), q2 -95.25 deg (-360 to 360), q3 "
         "nan deg"},
        {Checked(outside), "outside its limits"},
        {Checked({0, 0, 0, 0, 0, 0}), "all joints exactly zero"}}) {
    INFO(found.finding << '\n' << found.remedy);
    CHECK(found.health == cli::Health::kFault);
    CHECK_THAT(found.finding, Catch::Contains("answers, but its reading is not trusted: ") &&
                                  Catch::Contains(why));
    CHECK_FALSE(found.remedy.empty());
  }
}

}  // namespace plumbline::robot_reading_test
