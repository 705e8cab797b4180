#include "app/imports/ask.h"

#include <catch2/catch.hpp>
#include <sstream>

namespace plumbline::ask_test {

using namespace plumbline::imports;

TEST_CASE("questions about a table are answered once and kept") {
  const std::string text = "alpha,beta,range\n0.1,5,1\n0.2,6,2\n";
  config::FaultList faults;
  const UnderstoodFile file = Understand(text, "f.csv", FileRole::kMeasured, {}, "", {}, faults);
  std::istringstream answers("length\nq1_deg\nrad\n\nm\n");
  std::ostringstream questions;
  const auto mapping = AskMapping(file, answers, questions);
  REQUIRE(mapping);
  CHECK_THAT(questions.str(), Catch::Contains("column 1 alpha (0.1, 0.2): which quantity?") &&
                                  Catch::Contains("one of q1_deg") &&
                                  Catch::Contains("unit of range_mm?"));
  faults = {};
  const auto kept = MappingFromText(TextOfMapping(*mapping), "m.toml", faults);
  INFO(config::FaultsText(faults));
  REQUIRE(kept);
  const UnderstoodFile again =
      Understand(text, "f.csv", FileRole::kMeasured, *kept, "m.toml", {}, faults);
  CHECK_FALSE(faults.HasFaults());
  CHECK(again.meanings[0].unit == "rad");
  CHECK(again.meanings[1].target.empty());
  CHECK(RowsOf(again, {}).rows[1].numbers.at("range_mm") == 2000);
  std::istringstream silent("q1_deg\n");
  CHECK_FALSE(AskMapping(file, silent, questions));
}

}  // namespace plumbline::ask_test
