#include "app/base/log/log.h"

#include <algorithm>
#include <catch2/catch.hpp>

#include "app/base/log/log_entry.h"

namespace plumbline::log_test {

using namespace plumbline::log;

namespace {

bool Has(const std::vector<std::string>& fields, const std::string& field) {
  return std::find(fields.begin(), fields.end(), field) != fields.end();
}

}  // namespace

TEST_CASE("an entry goes to journald with its fields") {
  const LogEntry entry{Event::kPointCorrected,
                       "point 7 (left) corrected by 0.53 mm",
                       {{"POINT", "7"}, {"CORRECTION_MM", "0.530"}}};
  const auto fields = JournalFields(entry, {"ur10", 3}, "plumblined");
  CHECK(Has(fields, "MESSAGE=point 7 (left) corrected by 0.53 mm"));
  CHECK(Has(fields, "PRIORITY=6"));
  CHECK(Has(fields, "SYSLOG_IDENTIFIER=plumblined"));
  CHECK(Has(fields, std::string("MESSAGE_ID=") + EntryOf(Event::kPointCorrected).id));
  CHECK(Has(fields, "PLUMBLINE_EVENT=point-corrected"));
  CHECK(Has(fields, "PLUMBLINE_COMPONENT=points"));
  CHECK(Has(fields, "PLUMBLINE_CELL=ur10"));
  CHECK(Has(fields, "PLUMBLINE_MODEL_VERSION=3"));
  CHECK(Has(fields, "PLUMBLINE_POINT=7"));
  CHECK(Has(fields, "PLUMBLINE_CORRECTION_MM=0.530"));
}

TEST_CASE("unknown context and field names that journald would refuse are left out") {
  const LogEntry entry{Event::kEnding, "stopping", {{"small", "1"}, {"", "2"}, {"A=B", "3"}}};
  const auto fields = JournalFields(entry, {}, "plumblined");
  CHECK(fields.size() == 6);
}

TEST_CASE("a line shows the control characters of what it quotes, and does not execute them") {
  Log({Event::kEnding,
       "cell \033[2J\a",
       {{"NAME",
         "\xC2\x9B"
         "31m"}}});
  REQUIRE_FALSE(RecentLog().empty());
  CHECK(RecentLog().back().text == "cell \\u001b[2J\\u0007");
}

TEST_CASE("a quoted line end does not start a second entry") {
  Log({Event::kEnding, "cell left\n<2>robot link lost\n"});
  REQUIRE_FALSE(RecentLog().empty());
  CHECK(RecentLog().back().text == "cell left\\u000a<2>robot link lost");
}

}  // namespace plumbline::log_test
