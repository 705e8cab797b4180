#include "app/base/text/delimited_text.h"

#include <catch2/catch.hpp>

#include "app/base/text/text_encoding.h"

namespace plumbline::delimited_text_test {

using namespace plumbline::text;

TEST_CASE("numbers with a decimal point or comma, signs, groups and exponents") {
  CHECK(NumberIn("1.5", '.') == 1.5);
  CHECK(NumberIn(" +01.2345 ", '.') == 1.2345);
  CHECK(NumberIn("-1,5", ',') == -1.5);
  CHECK(NumberIn("1.234.567,5", ',') == 1234567.5);
  CHECK(NumberIn("1,234.5", '.') == 1234.5);
  CHECK(NumberIn("'3", '.') == 3);
  CHECK(NumberIn("1,5e-3", ',') == 1.5e-3);
  for (const char* wrong : {"", "1,5", "12,34.5", "nan", "inf", "1e999", "1.2.3", "X", "-", "+-1",
                            "1 2", "0x10", ",123"}) {
    CAPTURE(wrong);
    CHECK_FALSE(NumberIn(wrong, '.'));
  }
}

TEST_CASE("separator, decimal sign and header of common exports") {
  const DelimitedText german =
      LayoutOf("Name;X;Y;Z\r\nP1;1,5;2,25;-3,125\r\nP2;1.100,5;2,5;0\r\n", {});
  CHECK(german.separator == ';');
  CHECK(german.decimal == ',');
  CHECK_FALSE(german.decimal_assumed);
  CHECK(german.header_line == 1);
  REQUIRE(german.records.size() == 2);
  CHECK(german.records[1].line == 3);
  CHECK(german.records[1].fields[1] == "1.100,5");

  // Semicolons with decimal points: the separator does not prove the sign.
  CHECK(LayoutOf("a;b\n1.5;2\n2.5;3\n", {}).decimal == '.');
  // Nothing decides whether these are thousands.
  const DelimitedText unclear = LayoutOf("a;b\n1,234;2\n5,678;3\n", {});
  CHECK(unclear.decimal == ',');
  CHECK(unclear.decimal_assumed);
  CHECK(LayoutOf("a;b\n1,234;2\n", {{}, '.', {}}).decimal == '.');

  const DelimitedText padded = LayoutOf("   0.5     1.25    3\n  10.5   -1.25   13\n", {});
  CHECK(padded.separator == ' ');
  CHECK(padded.header_line == 0);
  CHECK(padded.names.size() == 3);
  CHECK(padded.records.size() == 2);

  const DelimitedText commented =
      LayoutOf("// Units: mm\nSystem A\n\nx, y, z\n[mm],[mm],[mm]\n1.0,2.0,\"3.0\"\n", {});
  CHECK(commented.preamble == std::vector<std::string>{"// Units: mm", "System A"});
  CHECK(commented.header_line == 4);
  CHECK(commented.units[2] == "[mm]");
  REQUIRE(commented.records.size() == 1);
  CHECK(commented.records[0].fields[2] == "3.0");

  const DelimitedText tabs = LayoutOf("t\tx\n\t5,5\n1\t6,5\n", {});
  CHECK(tabs.separator == '\t');
  CHECK(tabs.records[0].fields == std::vector<std::string>{"", "5,5"});
  const DelimitedText gaps =
      LayoutOf("a\tb\tc\td\te\n1\t2\t3\t4\t5\n6\t7\t8\t\t\n9\t\t\t\t\r\n", {});
  REQUIRE(gaps.records.size() == 3);
  CHECK(gaps.records[1].fields == std::vector<std::string>{"6", "7", "8", ""});
  CHECK(gaps.records[2].fields == std::vector<std::string>{"9", "", "", ""});
  CHECK(LayoutOf("+01.5\t\n+02.5\t\n\t\n", {}).names.size() == 1);
  CHECK(LayoutOf("", {}).records.empty());
  CHECK(LayoutOf("+01.2345\nXXXXXXX\n-00.0001\n", {}).records.size() == 3);
}

TEST_CASE("%time of rostopic echo -p is a name, other lines with % are comments") {
  const DelimitedText topic = LayoutOf("%time,field.position0\n1,2\n3,4\n", {});
  CHECK(topic.names == std::vector<std::string>{"%time", "field.position0"});
  CHECK(LayoutOf("% made by MATLAB\na,b\n1,2\n", {}).names == std::vector<std::string>{"a", "b"});
}

TEST_CASE("encodings become UTF-8") {
  CHECK(DecodedFromBytes("\xEF\xBB\xBF"
                         "a")
            .text == "a");
  CHECK(DecodedFromBytes("\xB5m \xB0").text == "\xC2\xB5m \xC2\xB0");
  CHECK(DecodedFromBytes("\xC2\xB5m").encoding == "UTF-8");
  CHECK(DecodedFromBytes(std::string_view("\xFF\xFE"
                                          "a\0\xE4\0",
                                          6))
            .text == "a\xC3\xA4");
  CHECK(DecodedFromBytes("\xFE\xFF\xD8").text.empty());
}

}  // namespace plumbline::delimited_text_test
