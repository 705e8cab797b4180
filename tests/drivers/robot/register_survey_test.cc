// Survey of unknown registers over a socket: what is refused, late, or answered by another unit.
#include "drivers/robot/register_survey.h"

#include <catch2/catch.hpp>

#include "tests/drivers/robot/fake_controller.h"

namespace plumbline::robot {
namespace {

using Exchange = FakeController::Exchange;
using Then = FakeController::Then;

int WordOf(const Exchange& exchange, std::size_t at) {
  return exchange.request[at] << 8 | exchange.request[at + 1];
}
int FirstOf(const Exchange& exchange) {
  return WordOf(exchange, 8);
}
int CountOf(const Exchange& exchange) {
  return WordOf(exchange, 10);
}

Then Refuse(Exchange& exchange, int code) {
  exchange.answer.resize(9);
  exchange.answer[4] = 0;
  exchange.answer[5] = 3;
  exchange.answer[7] = static_cast<std::uint8_t>(exchange.request[7] | 0x80);
  exchange.answer[8] = static_cast<std::uint8_t>(code);
  return Then::kAnswer;
}

RegisterClient ClientOf(const FakeController& controller) {
  return RegisterClient({"127.0.0.1", controller.port(), 0.1, 0, 4000});
}

const std::vector<RegisterBlock> kBlocks = {{RegisterTable::kHolding, 0, 12}};

}  // namespace

TEST_CASE("the client reports words, exceptions and silence, and connects again") {
  FakeController controller;
  controller.Set(3, 77);
  controller.Behave([](Exchange& exchange) {
    if (FirstOf(exchange) == 9) return Then::kGoOn;  // no answer
    return FirstOf(exchange) == 5 ? Refuse(exchange, 2) : Then::kAnswer;
  });
  RegisterClient client = ClientOf(controller);
  CHECK(client.Read(1, {RegisterTable::kHolding, 3, 1}).words == std::vector<std::uint16_t>{77});
  CHECK(client.Read(1, {RegisterTable::kHolding, 5, 1}).Text() ==
        "exception 0x02 (no such register)");
  CHECK(client.Read(1, {RegisterTable::kHolding, 9, 1}).kind == ReadOutcome::Kind::kSilent);
  CHECK(client.Read(1, {RegisterTable::kHolding, 3, 1}).ok());
  CHECK(client.requests() == 4);
}

TEST_CASE("one late answer makes neither a boundary nor another unit") {
  for (int late = 1; late <= 4; ++late) {
    FakeController controller;
    for (int a = 0; a < 300; ++a) controller.Set(a, static_cast<std::uint16_t>(a));
    controller.Behave([late](Exchange& exchange) {
      return exchange.number == late ? Then::kGoOn : Then::kAnswer;
    });
    RegisterClient client = ClientOf(controller);
    SurveyOptions options;
    options.ranges = {{0, 299}};
    const DeviceMap map = Survey(client, options);
    INFO("request " << late << " is not answered");
    REQUIRE(map.unit == 1);
    REQUIRE(map.images.size() == 1);
    CHECK(RangesText(map.images[0]) == "0-299");
    CHECK(map.images[0].starts.empty());
    CHECK(map.max_count == 125);
  }
}

TEST_CASE("a device that loses requests is not another unit; a gateway's exception names one") {
  FakeController controller;
  RegisterClient client = ClientOf(controller);
  SECTION("it loses two requests of three") {
    controller.Behave(
        [](Exchange& exchange) { return exchange.number % 3 == 0 ? Then::kAnswer : Then::kGoOn; });
    const LinkRemedyText found = ExamineLink(client, 1, kBlocks);
    INFO(found.what << ": " << found.remedy);
    CHECK_THAT(found.what, Catch::Contains("no answer in time"));
    CHECK_THAT(found.remedy, Catch::Contains("timeout_ms") && !Catch::Contains("unit_id"));
  }
  SECTION("nobody but unit 255 answers") {
    controller.Behave([](Exchange& exchange) {
      return exchange.request[6] == 255 ? Then::kAnswer : Then::kGoOn;
    });
    CHECK_THAT(ExamineLink(client, 1, kBlocks).remedy, Catch::Contains("unit_id = 255"));
  }
  SECTION("the gateway has no path to others") {
    controller.Behave([](Exchange& exchange) {
      return exchange.request[6] == 255 ? Then::kAnswer : Refuse(exchange, 0x0A);
    });
    CHECK_THAT(ExamineLink(client, 1, kBlocks).remedy, Catch::Contains("unit_id = 255"));
  }
}

TEST_CASE("registers that are only read in pairs are counted in pairs") {
  FakeController controller;
  controller.Behave([](Exchange& exchange) {
    const int first = FirstOf(exchange), count = CountOf(exchange);
    return first % 2 == 0 && count % 2 == 0 && first + count <= 10 ? Then::kAnswer
                                                                   : Refuse(exchange, 2);
  });
  RegisterClient client = ClientOf(controller);
  const LinkRemedyText found = ExamineLink(client, 1, kBlocks);
  CHECK(found.what == "exception 0x02 at 0 x 12: the first missing register is 10");
}

TEST_CASE("a survey ends at its number of registers and says how to go on") {
  FakeController controller;
  for (int a = 0; a < 1024; ++a) controller.Set(a, 7);
  RegisterClient client = ClientOf(controller);
  SurveyOptions options;
  options.max_words = 300;
  const DeviceMap map = Survey(client, options);
  CHECK_FALSE(map.complete);
  REQUIRE_FALSE(map.notes.empty());
  CHECK_THAT(map.notes.back(), Catch::Contains("--range"));
  REQUIRE_FALSE(map.images.empty());
  CHECK(map.images[0].words.size() < 500);
}

}  // namespace plumbline::robot
