// The doctor's judgement of a robot that answers: the daemon's, with the joints shown.
#include "app/cli/doctor/robot_reading.h"

#include <bit>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <limits>

#include "app/base/config/daemon_config_reader.h"
#include "drivers/clock.h"
#include "tests/app/temporary_folder.h"
#include "tests/drivers/robot/fake_controller.h"

namespace plumbline::robot_reading_test {
namespace {

void SetJoints(robot::FakeController& controller, const std::array<float, 6>& joints_deg,
               int first = 0, bool low_word_first = false) {
  for (int j = 0; j < 6; ++j) {
    const auto bits = std::bit_cast<std::uint32_t>(joints_deg[static_cast<std::size_t>(j)]);
    const auto high = static_cast<std::uint16_t>(bits >> 16),
               low = static_cast<std::uint16_t>(bits);
    controller.Set(first + 2 * j, low_word_first ? low : high);
    controller.Set(first + 2 * j + 1, low_word_first ? high : low);
  }
}

/// What the doctor finds of a controller with joints from register 0 on.
/// @param profile  further lines
cli::CheckResult Found(const robot::FakeController& controller, const std::string& profile = "") {
  const test::TemporaryFolder folder;
  std::filesystem::copy("config/cells", folder.path() + "/cells");
  std::ofstream(folder.path() + "/p.toml")
      << "schema = 1\nname = \"p\"\nsource = \"test\"\nport = 502\nunit_id = 1\n"
         "[[read]]\ntable = \"holding\"\nfirst = 0\ncount = 14\n"
         "[[joints]]\ntable = \"holding\"\naddress = [0, 2, 4, 6, 8, 10]\ntype = \"float32\"\n"
         "unit = \"deg\"\n"
      << profile;
  const std::string file = folder.path() + "/plumbline.toml";
  std::ofstream(file) << "cell = \"cells/ur10.toml\"\nstate_directory = \"state\"\n[robot]\n"
                      << "profile = \"p.toml\"\nhost = \"127.0.0.1\"\nport = " << controller.port()
                      << "\ntimeout_ms = 1000\n[payload]\nsource = \"fixed\"\nmass_kg = 1.0\n";
  config::FaultList faults;
  const auto config = config::ReadDaemonConfig(file, faults);
  INFO(config::FaultsText(faults));
  REQUIRE(config);
  return cli::CheckRobot(*config);
}

cli::CheckResult Checked(const std::array<float, 6>& joints_deg, int first = 0,
                         bool low_word_first = false) {
  robot::FakeController controller;
  SetJoints(controller, joints_deg, first, low_word_first);
  return Found(controller);
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
        {Checked(kJoints, 1), "too small to be readings"},
        {Checked(nan),
         "joint 3 is not a number. q1 12.5 deg (-360 to 360), q2 -95.25 deg (-360 to 360), q3 "
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

TEST_CASE("a decoding that gives plausible joints is named, with what to change") {
  const cli::CheckResult swapped = Checked(kJoints, 0, true), late = Checked(kJoints, 1);
  CHECK_THAT(swapped.remedy,
             Catch::Contains("word order CDAB gives plausible joints (12.5, -95.25") &&
                 Catch::Contains("set word_order = \"CDAB\""));
  CHECK_THAT(late.remedy, Catch::Contains("address + 1 gives plausible joints (12.5, -95.25") &&
                              Catch::Contains("set address = [1, 3, 5, 7, 9, 11]"));
}

TEST_CASE("a profile that gives most joints rightly is not to be changed") {
  std::array<float, 6> nan = kJoints, outside = kJoints;
  nan[2] = std::numeric_limits<float>::quiet_NaN();
  outside[5] = 380;
  const cli::CheckResult without = Checked(nan), beyond = Checked(outside);
  CHECK_THAT(without.remedy, Catch::Contains("the controller itself may hold no number there") &&
                                 !Catch::Contains("set "));
  CHECK_THAT(beyond.remedy,
             Catch::Contains("check min_deg and max_deg of the cell") && !Catch::Contains("set "));
}

TEST_CASE("a request that the controller refuses is explained") {
  using Exchange = robot::FakeController::Exchange;
  robot::FakeController controller;
  SetJoints(controller, kJoints);
  int allowed = 125, unit = -1;
  std::string what, remedy;
  SECTION("a request that is too long") {
    allowed = 8;
    what = "a request of 14 registers is refused, 8 are answered", remedy = "split [[read]]";
  }
  SECTION("another unit id") {
    unit = 255;
    what =
        "exception 0x0B (no device behind the gateway answers to this unit id) from unit 1: "
        "unit 255 answers";
    remedy = "set unit_id = 255";
  }
  controller.Behave([&](Exchange& exchange) {
    const int count = exchange.request[10] << 8 | exchange.request[11];
    const int code = unit >= 0 && exchange.request[6] != unit ? 0x0B : count > allowed ? 3 : 0;
    if (code == 0) return robot::FakeController::Then::kAnswer;
    exchange.answer.resize(9);
    exchange.answer[4] = 0;
    exchange.answer[5] = 3;
    exchange.answer[7] = 0x83;
    exchange.answer[8] = static_cast<std::uint8_t>(code);
    return robot::FakeController::Then::kAnswer;
  });
  const cli::CheckResult found = Found(controller);
  INFO(found.finding << '\n' << found.remedy);
  CHECK(found.health == cli::Health::kFault);
  CHECK_THAT(found.finding, Catch::Contains(what));
  CHECK_THAT(found.remedy, Catch::Contains(remedy));
}

TEST_CASE("readings that the daemon would call stale are not good") {
  using Exchange = robot::FakeController::Exchange;
  robot::FakeController controller;
  SetJoints(controller, kJoints);
  const std::string sequence =
      "[sequence]\ntable = \"holding\"\naddress = [12]\ntype = \"uint16\"\n";
  cli::CheckResult found;
  std::string why = "answers, but its reading is not trusted: stale. q1 12.5 deg";
  std::string remedy = "controller refreshes its registers";
  SECTION("the refresh counter does not change") {
    found = Found(controller, sequence);
  }
  SECTION("the link is slower than stale_after_ms") {
    controller.Behave([](Exchange&) {
      SleepSeconds(0.15);
      return robot::FakeController::Then::kAnswer;
    });
    found = Found(controller);
    remedy = "robot.stale_after_ms";
  }
  SECTION("each reading is in time, but the next one comes too late") {
    controller.Behave([](Exchange&) {
      SleepSeconds(0.07);
      return robot::FakeController::Then::kAnswer;
    });
    found = Found(controller);
  }
  SECTION("the link is lost after a good reading") {
    controller.Behave([](const Exchange& exchange) {
      return exchange.number == 1 ? robot::FakeController::Then::kAnswer
                                  : robot::FakeController::Then::kClose;
    });
    found = Found(controller);
    why = "FC03, 14 from 0: ", remedy = "check the cable";
  }
  INFO(found.finding << '\n' << found.remedy);
  CHECK(found.health == cli::Health::kFault);
  CHECK_THAT(found.finding, Catch::Contains(why));
  CHECK_THAT(found.remedy, Catch::Contains(remedy));
}

TEST_CASE("a counter that advances makes a reading good") {
  robot::FakeController controller;
  SetJoints(controller, kJoints);
  controller.Behave([&](const robot::FakeController::Exchange& exchange) {
    controller.Set(12, static_cast<std::uint16_t>(exchange.number));
    return robot::FakeController::Then::kAnswer;
  });
  const cli::CheckResult found =
      Found(controller, "[sequence]\ntable = \"holding\"\naddress = [12]\ntype = \"uint16\"\n");
  INFO(found.finding);
  CHECK(found.health == cli::Health::kGood);
}

}  // namespace plumbline::robot_reading_test
