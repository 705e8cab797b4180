#include "app/measure/imports/ask.h"

#include <catch2/catch.hpp>
#include <sstream>

namespace plumbline::ask_test {

using namespace plumbline::measure;

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

TEST_CASE("columns that share a name are kept by number, and refused by name") {
  const std::string text = "x_mm,value,y_mm,value,z_mm\n1,20,2,30,3\n4,21,5,31,6\n";
  config::FaultList faults;
  const UnderstoodFile file = Understand(text, "f.csv", FileRole::kMeasured, {}, "", {}, faults);
  Mapping mapping = MappingOf(file);
  CHECK(mapping.columns[0].from == "x_mm");
  CHECK(mapping.columns[1].from.empty());
  CHECK(mapping.columns[3].number == 4);
  mapping.columns[3] = {"", 4, "temp_C", "C"};
  const UnderstoodFile again =
      Understand(text, "f.csv", FileRole::kMeasured, mapping, "m.toml", {}, faults);
  REQUIRE_FALSE(faults.HasFaults());
  CHECK(RowsOf(again, {}).rows[1].numbers.at("temp_C") == 31);
  Understand(text, "f.csv", FileRole::kMeasured, {{}, {{"value", 0, "temp_C", "C"}}}, "m.toml", {},
             faults);
  CHECK_THAT(config::FaultsText(faults), Catch::Contains("\"value\" is the name of 2 columns") &&
                                             Catch::Contains("number = 2 or 4"));
}

}  // namespace plumbline::ask_test
