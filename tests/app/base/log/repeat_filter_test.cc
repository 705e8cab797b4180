#include <catch2/catch.hpp>

#include "app/base/log/log.h"

namespace plumbline::repeat_filter_test {

using namespace plumbline::log;

namespace {

LogEntry Lost(const std::string& client, const std::string& text) {
  return {Event::kClientClosed, text, {{"CLIENT", client}}};
}

}  // namespace

TEST_CASE("five entries a minute are logged per subject, further ones are counted") {
  RepeatFilter filter;
  int logged = 0;
  for (int k = 0; k < 100; ++k)
    logged += filter.Admit(Lost("10.0.0.1", std::to_string(k)), 0.1 * k);
  CHECK(logged == RepeatFilter::kMaxPerMinute);
  CHECK(filter.Admit(Lost("10.0.0.2", "another"), 10));

  CHECK(filter.TakeSummaries(59).empty());
  const auto summaries = filter.TakeSummaries(60.1);
  REQUIRE(summaries.size() == 1);
  CHECK(summaries[0].event == Event::kRepeated);
  CHECK(summaries[0].text == "client-closed: 95 more in the last minute, the latest: 99");
  REQUIRE(summaries[0].fields.size() == 2);
  CHECK(summaries[0].fields[1].value == "95");

  // The next minute starts.
  CHECK(filter.Admit(Lost("10.0.0.1", "again"), 61));
  CHECK(filter.TakeSummaries(1000).empty());
}

TEST_CASE("before exit every count is summarized") {
  RepeatFilter filter;
  for (int k = 0; k < 7; ++k) filter.Admit(Lost("10.0.0.1", "x"), 0);
  const auto summaries = filter.TakeSummaries(1, true);
  REQUIRE(summaries.size() == 1);
  CHECK(summaries[0].text == "client-closed: 2 more in the last minute, the latest: x");
}

TEST_CASE("a client with ever new addresses fills neither the memory nor the log") {
  RepeatFilter filter;
  std::size_t logged = 0;
  for (int k = 0; k < 100000; ++k) logged += filter.Admit(Lost(std::to_string(k), "x"), 1);
  CHECK(logged <= RepeatFilter::kMaxSubjects + RepeatFilter::kMaxPerMinute);
  CHECK(filter.TakeSummaries(100).size() == 1);
}

TEST_CASE(
    "a loose cable for a month: at most six lines a minute, and every entry is logged or counted") {
  RepeatFilter filter;
  constexpr int kMinutes = 30 * 24 * 60;
  std::int64_t logged = 0, counted = 0;
  for (int minute = 0; minute < kMinutes; ++minute) {
    for (int k = 0; k < 20; ++k) {
      logged += filter.Admit(Lost("10.0.0.1", "x"), 60.0 * minute + 3 * k);
    }
    for (const LogEntry& entry : filter.TakeSummaries(60.0 * minute + 59.99)) {
      ++logged;
      counted += std::stoi(entry.fields[1].value);
    }
  }
  CHECK(logged <= 6 * kMinutes);
  CHECK(logged + counted >= 20 * kMinutes - 20);  // none is lost silently
}

}  // namespace plumbline::repeat_filter_test
