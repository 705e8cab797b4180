#include "app/log/repeats.h"

#include <catch2/catch.hpp>

using namespace plumbline;

namespace {

LogEntry Lost(const std::string& client, const std::string& text) {
  return {Event::kClientClosed, text, {{"CLIENT", client}}};
}

}  // namespace

TEST_CASE("five entries a minute of one subject are told, the others counted") {
  Repeats repeats;
  int told = 0;
  for (int k = 0; k < 100; ++k) told += repeats.Pass(Lost("10.0.0.1", std::to_string(k)), 0.1 * k);
  CHECK(told == Repeats::kMostAMinute);
  CHECK(repeats.Pass(Lost("10.0.0.2", "another"), 10));

  CHECK(repeats.Due(59).empty());
  const auto due = repeats.Due(60.1);
  REQUIRE(due.size() == 1);
  CHECK(due[0].event == Event::kRepeated);
  CHECK(due[0].text == "client-closed: 95 more in the last minute, the latest: 99");
  REQUIRE(due[0].fields.size() == 2);
  CHECK(due[0].fields[1].value == "95");

  // A new minute begins.
  CHECK(repeats.Pass(Lost("10.0.0.1", "again"), 61));
  CHECK(repeats.Due(1000).empty());
}

TEST_CASE("at the end all that was counted is told") {
  Repeats repeats;
  for (int k = 0; k < 7; ++k) repeats.Pass(Lost("10.0.0.1", "x"), 0);
  const auto due = repeats.Due(1, true);
  REQUIRE(due.size() == 1);
  CHECK(due[0].text == "client-closed: 2 more in the last minute, the latest: x");
}

TEST_CASE("a stranger with ever new addresses does not fill the memory, nor the log") {
  Repeats repeats;
  std::size_t told = 0;
  for (int k = 0; k < 100000; ++k) told += repeats.Pass(Lost(std::to_string(k), "x"), 1);
  CHECK(told <= Repeats::kMostSubjects + Repeats::kMostAMinute);
  CHECK(repeats.Due(100).size() == 1);
}

TEST_CASE("a month of a loose cable, by many clients: six lines a minute, and nothing grows") {
  Repeats repeats;
  constexpr int kMinutes = 30 * 24 * 60;
  std::int64_t told = 0, counted = 0;
  for (int minute = 0; minute < kMinutes; ++minute) {
    for (int k = 0; k < 20; ++k) {
      told += repeats.Pass(Lost("10.0.0.1", "x"), 60.0 * minute + 3 * k);
    }
    for (const LogEntry& entry : repeats.Due(60.0 * minute + 59.99)) {
      ++told;
      counted += std::stoi(entry.fields[1].value);
    }
  }
  CHECK(told <= 6 * kMinutes);
  CHECK(told + counted >= 20 * kMinutes - 20);  // none is passed over in silence
}
