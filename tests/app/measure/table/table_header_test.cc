#include "app/measure/table/table_header.h"

#include <fmt/format.h>

#include <catch2/catch.hpp>

namespace plumbline::table_header_test {

using namespace plumbline::measure;

namespace {

/// A revolute and a prismatic joint.
std::vector<model::Joint> OneOfEachType() {
  std::vector<model::Joint> joints(2);
  joints[1].type = model::JointType::kPrismatic;
  return joints;
}

std::optional<TableHeader> Header(std::string_view line, config::FaultList& faults) {
  return HeaderFromCsv(line, "measured.csv", OneOfEachType(), faults);
}

TEST_CASE("a header gives the meaning of each column in the order of the file") {
  config::FaultList faults;
  const auto header = Header("q2_mm, wait_min,q1_deg,air_bar,payload_kg\r", faults);
  REQUIRE(header);
  REQUIRE(header->columns.size() == 5);
  CHECK(header->columns[0].quantity == Quantity::kQ);
  CHECK(header->columns[0].index == 1);
  CHECK(header->columns[0].to_si == 1e-3);
  CHECK(header->columns[1].quantity == Quantity::kUnused);
  CHECK(header->columns[2].index == 0);
  CHECK(header->columns[3].quantity == Quantity::kFurther);
  CHECK(header->further == std::vector<std::string>{"air_bar"});
  CHECK(header->recorded.payload);
  CHECK_FALSE(header->recorded.position);
}

TEST_CASE("a header with too many columns is refused by their number, before any is read") {
  const auto header = [](int columns, config::FaultList& faults) {
    std::string line = "q1_deg,q2_mm";
    for (int k = 2; k < columns; ++k) line += fmt::format(",signal_{}", k);
    return Header(line, faults);
  };
  config::FaultList none, one;
  CHECK(header(kMaxColumns, none));
  CHECK_FALSE(none.HasFaults());
  CHECK_FALSE(header(1'000'000, one));
  REQUIRE(one.All().size() == 1);  // not one for each column
  CHECK_THAT(one.All()[0].what, Catch::StartsWith("has 1000000 columns, but at most 256 are read"));
}

TEST_CASE("Each fault of a header has its message, and all are reported") {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "measured.csv:1: has no header row\n"},
      {"\r\n", "measured.csv:1: has no header row\n"},
      {"q1_deg;q2_mm\n",
       "measured.csv:1: is separated by ';': separate columns by ',' with decimal points\n"},
      {"q1_deg\n", "measured.csv:1 q2_mm: missing column\n"},
      {"x_mm,y_mm,z_mm\n",
       "measured.csv:1 q1_deg: missing column\nmeasured.csv:1 q2_mm: missing column\n"},
      {"q1_deg,q2_deg\n",
       "measured.csv:1 q2_deg: does not fit the cell: it has 2 joints, revolute ones in deg and "
       "Nm, prismatic ones in mm and N\nmeasured.csv:1 q2_mm: missing column\n"},
      {"q1_deg,q2_mm,q3_deg\n",
       "measured.csv:1 q3_deg: does not fit the cell: it has 2 joints, revolute ones in deg and "
       "Nm, prismatic ones in mm and N\n"},
      {"q1_deg,q2_mm,q1_deg\n", "measured.csv:1 q1_deg: appears twice\n"},
      {"q1_deg,q2_mm,note,note\n",
       "measured.csv:1 note: warning: is not a column of the format: treated as an additional "
       "signal\n"
       "measured.csv:1 note: appears twice\n"
       "measured.csv:1 note: warning: is not a column of the format: treated as an additional "
       "signal\n"},
      {"q1_deg,q2_mm,\x1b[2J,x_mm,z_mm\n",
       "measured.csv:1 ?[2J: warning: is not a column of the format: treated as an additional "
       "signal\nmeasured.csv:1 y_mm: missing "
       "column\n"},
      {"q1_deg," + std::string(50, 'z') + "\n",
       "measured.csv:1 " + std::string(40, 'z') +
           "...: warning: is not a column of the format: treated as an additional "
           "signal\nmeasured.csv:1 "
           "q2_mm: missing column\n"},
      {"q1_deg,q2_mm,x_mm,z_mm\n", "measured.csv:1 y_mm: missing column\n"},
      {"q1_deg,q2_mm,qd2_mm_s\n", "measured.csv:1 qd1_deg_s: missing column\n"},
      {"q1_deg,q2_mm,qw,qx,qz\n", "measured.csv:1 qy: missing column\n"}};
  for (const auto& [header, expected] : cases) {
    config::FaultList faults;
    CAPTURE(header);
    CHECK_FALSE(Header(header.substr(0, header.find('\n')), faults));
    CHECK(FaultsText(faults) == expected);
  }
}

TEST_CASE("A misspelled column gets a suggestion") {
  const std::pair<const char*, const char*> asked[] = {{"payload_g", "payload_kg"},
                                                       {"paylod_kg", "payload_kg"},
                                                       {"temp_F", "temp_C"},
                                                       {"x", "x_mm"}};
  for (const auto& [name, meant] : asked) {
    config::FaultList faults;
    CAPTURE(name);
    REQUIRE(Header(std::string("q1_deg,q2_mm,") + name, faults));
    CHECK_THAT(FaultsText(faults), Catch::Contains(std::string("did you mean ") + meant + "?"));
  }
  config::FaultList faults;
  REQUIRE(Header("q1_deg,q2_mm,payload_kg,payload_g,operator", faults));
  CHECK_THAT(FaultsText(faults), !Catch::Contains("did you mean"));
}

TEST_CASE("fields are split at commas and trimmed, and shown without unprintable characters") {
  std::vector<std::string_view> fields;
  SplitFields(" a,,b\t c \r", fields);
  CHECK(fields == std::vector<std::string_view>{"a", "", "b\t c"});
  SplitFields("", fields);
  CHECK(fields == std::vector<std::string_view>{""});
  std::string_view rest = "one\ntwo";
  CHECK(TakeUntil('\n', rest) == "one");
  CHECK(TakeUntil('\n', rest) == "two");
  CHECK(rest.empty());
  CHECK(Shown("\x1b[2J") == "\"?[2J\"");
  CHECK(Shown(std::string(50, 'z')) == "\"" + std::string(40, 'z') + "...\"");
  CHECK(ShownName("x_mm") == "x_mm");
}

}  // namespace
}  // namespace plumbline::table_header_test
