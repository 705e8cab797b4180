#include "drivers/gauge/gauge_codec.h"

#include <catch2/catch.hpp>
#include <string>
#include <vector>

namespace plumbline::gauge_codec_test {

using namespace plumbline::gauge;
using Kind = GaugeLine::Kind;

namespace {

GaugeLine Parsed(const char* format, std::string_view line) {
  const GaugeFormat* const found = FindGaugeFormat(format);
  REQUIRE(found != nullptr);
  return found->parse(line);
}

void CheckReading(const char* format, std::string_view line, double value,
                  std::optional<GaugeUnit> unit = {}) {
  CAPTURE(format, line);
  const GaugeLine found = Parsed(format, line);
  CHECK(found.kind == Kind::kReading);
  CHECK(found.value == value);
  CHECK(found.unit == unit);
}

}  // namespace

TEST_CASE("the lines of the manuals are read with sign, decimals and unit") {
  CheckReading("mitutoyo", "01A+0000.123", 0.123);
  CheckReading("mitutoyo", "01A-0012.500", -12.5);
  CheckReading("mitutoyo", "01A+00.12345", 0.12345);
  CheckReading("starrett", "+ 2.1380, MM", 2.138, GaugeUnit::kMillimetre);
  CheckReading("starrett", "- 0.0842, IN", -0.0842, GaugeUnit::kInch);
  CheckReading("sylvac", "+12.345", 12.345);
  CheckReading("sylvac", "-0.001", -0.001);
  CheckReading("mahr", "1 +123.45 mm", 123.45, GaugeUnit::kMillimetre);
  CheckReading("mahr", "2 -0.5 in", -0.5, GaugeUnit::kInch);
  CheckReading("plain", "-.125", -0.125);
  CheckReading("plain", "3 mm", 3, GaugeUnit::kMillimetre);
  CheckReading("plain", "0.5inch", 0.5, GaugeUnit::kInch);
  CHECK(MetresPer(GaugeUnit::kInch) == 0.0254);
}

TEST_CASE("a gauge's own fault is not a reading") {
  for (const auto& [format, line] : std::vector<std::pair<const char*, const char*>>{
           {"mitutoyo", "911"}, {"mitutoyo", "918"}, {"sylvac", "ERR3"}, {"mahr", "ERR6"}}) {
    CAPTURE(format, line);
    const GaugeLine found = Parsed(format, line);
    CHECK(found.kind == Kind::kFault);
    CHECK_FALSE(found.fault.empty());
  }
}

TEST_CASE("a damaged line, or one of another format, is never a reading") {
  const std::vector<std::string> damaged = {"",
                                            "A",
                                            "+",
                                            "1.2.3",
                                            "--1",
                                            "1e3",
                                            "nan",
                                            "0x10",
                                            "12345678901",
                                            "1 2",
                                            "+ 2.1380,",
                                            "1.5 cm",
                                            "01A0000.123",
                                            "01A+000.123",
                                            "1A+00000.123",
                                            "01B+0.1234",
                                            "01A+0000.12x",
                                            "+1.0, kg",
                                            "1 + mm",
                                            std::string("1\0.5", 4)};
  for (const GaugeFormat& format : GaugeFormats()) {
    for (const std::string& line : damaged) {
      CAPTURE(std::string(format.name), line);
      CHECK(format.parse(line).kind == Kind::kOther);
    }
  }
  CHECK(Parsed("mitutoyo", "+12.345").kind == Kind::kOther);
  CHECK(Parsed("sylvac", "12.345").kind == Kind::kOther);  // its sign is lost
  CHECK(Parsed("sylvac", "+12.345 mm").kind == Kind::kOther);
  CHECK(Parsed("starrett", "+ 2.1380").kind == Kind::kOther);
  CHECK(Parsed("mahr", "1 +123.45").kind == Kind::kOther);
}

TEST_CASE("bytes become lines at CR, LF or both; a line that is too long stays unreadable") {
  LineReceiver receiver;
  std::vector<std::string> lines;
  const auto push = [&](std::string_view bytes) {
    for (const char byte : bytes) {
      if (const auto line = receiver.Push(byte)) lines.emplace_back(*line);
    }
  };
  push("+1.0\r\n +2.0 \n\r\r+3");
  CHECK(lines == std::vector<std::string>{"+1.0", "+2.0"});
  push(".0\r");
  CHECK(lines.back() == "+3.0");
  push(std::string(40, ' ') + "\r");
  CHECK(lines.size() == 3);  // blanks alone are an empty line
  push("5.0" + std::string(70, ' ') + "x\r");
  REQUIRE(lines.size() == 4);
  CHECK(FindGaugeFormat("plain")->parse(lines.back()).kind == Kind::kOther);
  lines.pop_back();
  push(std::string(1000, '1') + "\r");
  REQUIRE(lines.size() == 4);
  for (const GaugeFormat& format : GaugeFormats())
    CHECK(format.parse(lines.back()).kind == Kind::kOther);
}

}  // namespace plumbline::gauge_codec_test
