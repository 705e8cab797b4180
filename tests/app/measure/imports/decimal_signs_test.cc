#include "app/measure/imports/decimal_signs.h"

#include <catch2/catch.hpp>

#include "app/measure/imports/preview.h"

namespace plumbline::decimal_signs_test {

using namespace plumbline::measure;
using Catch::Contains;

namespace {

struct Read {
  UnderstoodFile file;
  std::string faults;
  ImportedTable rows;
};

Read ReadText(const std::string& text, const ImportOptions& options = {}) {
  config::FaultList faults;
  UnderstoodFile file = Understand(text, "f.csv", FileRole::kMeasured, {}, "", options, faults);
  ImportedTable rows = RowsOf(file, options);
  return {std::move(file), config::FaultsText(faults), std::move(rows)};
}

}  // namespace

TEST_CASE("columns with different decimal signs are refused, whichever sign prevails") {
  const Read point = ReadText(
      "Number;X [mm];Y [mm];Z [mm]\n1;-522.458;1089,658;321,986\n2;36.494;81,410;105.106\n"
      "3;36.494;512,176;205.106\n");
  CHECK_THAT(point.faults, Contains("f.csv:1 column \"Y [mm]\": has a decimal comma (\"1089,658\" "
                                    "in line 2), but column \"X [mm]\" has a decimal point") &&
                               Contains("\"81,410\" could be 81.41 or 81410. Export"));
  CHECK_FALSE(point.file.readable);
  for (const ImportedRow& row : point.rows.rows) CHECK(row.numbers.count("y_mm") == 0);
  CHECK_THAT(PreviewText(point.file, point.rows),
             Contains("rows not read") && !Contains("rejected"));

  const Read comma = ReadText("X [mm];Y [mm];Z [mm]\n1,5;2,25;81.410\n1,5;2,25;1089.658\n");
  CHECK_THAT(comma.faults, Contains("column \"Z [mm]\": has a decimal point (\"1089.658\" in line "
                                    "3), but column \"X [mm]\" has a decimal comma"));
  ImportOptions options;
  options.decimal = '.';
  CHECK_THAT(ReadText("X [mm];Y [mm];Z [mm]\n1,5;2,5;0,512\n", options).faults,
             Contains("but the decimal sign is stated as point; give --decimal comma"));
}

TEST_CASE("values that may have thousands separators need a proof or the user's word") {
  const std::string unclear = "X [mm];Y [mm];Z [mm]\n1.5;81,410;3.5\n2.5;91,410;4.5\n";
  const Read refused = ReadText(unclear);
  CHECK_THAT(
      refused.faults,
      Contains("column \"Y [mm]\": holds \"81,410\" in line 2, which may be 81.41 or 81410") &&
          Contains("--decimal point"));
  ImportOptions options;
  options.decimal = '.';
  const Read stated = ReadText(unclear, options);
  CHECK(stated.faults.empty());
  CHECK(stated.rows.rows[0].numbers.at("y_mm") == 81410);
  const Read proven = ReadText("X [mm];Y [mm];Z [mm]\n1.5;1,410;3.5\n2.5;1,410.5;4.5\n");
  CHECK(proven.faults.empty());
  CHECK(proven.rows.rows[0].numbers.at("y_mm") == 1410);
}

TEST_CASE("one typing error in a column rejects its line and every unclear value, not the file") {
  const Read read = ReadText(
      "X [mm];Y [mm];Z [mm]\n1.5;1.5;3\n1.5;12,34;3\n1.5;81,410;3\n1.5;2.5;3\n1.5;3.5;3\n");
  CHECK(read.faults.empty());
  REQUIRE(read.rows.rejected.size() == 2);
  CHECK_THAT(read.rows.rejected[0].reason, Contains("\"12,34\", which is not a number"));
  CHECK_THAT(read.rows.rejected[1].reason,
             Contains("y_mm is \"81,410\", whose comma may be a decimal sign"));
}

TEST_CASE("a group of thousands does not start with a zero") {
  CHECK_FALSE(text::NumberIn("0,512", '.'));
  CHECK_FALSE(text::NumberIn("-0,512", '.'));
  CHECK(text::NumberIn("0,512", ',') == 0.512);
  CHECK(text::LayoutOf("a;b\n0,512;2\n", {}).decimal == ',');
  CHECK_FALSE(text::LayoutOf("a;b\n0,512;2\n", {}).decimal_assumed);
}

}  // namespace plumbline::decimal_signs_test
