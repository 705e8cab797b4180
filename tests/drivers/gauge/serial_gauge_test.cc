#include <catch2/catch.hpp>
#include <string>

#include "drivers/gauge/gauge.h"
#include "tests/drivers/gauge/fake_gauge.h"

namespace plumbline::serial_gauge_test {

using namespace plumbline::gauge;

namespace {

Gauge GaugeAt(const std::string& device, const char* format,
              GaugeUnit unit = GaugeUnit::kMillimetre) {
  const GaugeFormat* const found = FindGaugeFormat(format);
  return Gauge({.device = device, .line = found->line, .hid = {}, .format = found, .unit = unit});
}

/// Waits until the line has been silent after the connection.
void Settle(Gauge& gauge) {
  double reading_m = 0;
  for (int k = 0; k < 5; ++k) REQUIRE(gauge.Read(0.06, reading_m) == GaugeResult::kNothing);
}

}  // namespace

TEST_CASE("each press is one reading in metres, however its bytes arrive") {
  const test::FakeGauge device;
  Gauge gauge = GaugeAt(device.device(), "mitutoyo");
  Settle(gauge);
  double reading_m = 0;
  CHECK(gauge.Read(0, reading_m) == GaugeResult::kNothing);
  device.Send("01A-00");
  CHECK(gauge.Read(0.5, reading_m) == GaugeResult::kNothing);
  device.Send("12.500\r\n01A+0000.125\r\n");
  REQUIRE(gauge.Read(0.5, reading_m) == GaugeResult::kReading);
  CHECK(reading_m == Approx(-0.0125));
  REQUIRE(gauge.Read(0.5, reading_m) == GaugeResult::kReading);
  CHECK(reading_m == Approx(1.25e-4));
  CHECK(gauge.Read(0, reading_m) == GaugeResult::kNothing);
}

TEST_CASE("a line whose beginning may be lost is discarded: after connecting, and after a pause") {
  const test::FakeGauge device;
  Gauge gauge = GaugeAt(device.device(), "plain");
  double reading_m = 0;
  REQUIRE(gauge.Read(0, reading_m) == GaugeResult::kNothing);  // connects
  device.Send("2.5\r\n");                                      // of 12.5
  CHECK(gauge.Read(0.1, reading_m) == GaugeResult::kNothing);
  Settle(gauge);
  device.Send("12.");  // the rest is lost
  CHECK(gauge.Read(0.1, reading_m) == GaugeResult::kNothing);
  CHECK(gauge.Read(0.25, reading_m) == GaugeResult::kUnreadable);
  CHECK(std::string(gauge.problem())
            .find("unreadable data: \"12.\", to which no end of a line was received, is not") !=
        std::string::npos);
  Settle(gauge);           // reported once
  device.Send("345\r\n");  // not a line of its own
  CHECK(gauge.Read(0.5, reading_m) == GaugeResult::kUnreadable);
  CHECK(std::string(gauge.problem()).find("a line was interrupted") != std::string::npos);
  device.Send("0.25\r\n");
  REQUIRE(gauge.Read(0.5, reading_m) == GaugeResult::kReading);
  CHECK(reading_m == Approx(2.5e-4));
}

TEST_CASE("a gauge that never pauses is reported, not read") {
  const test::FakeGauge device;
  Gauge gauge = GaugeAt(device.device(), "plain");
  double reading_m = 0;
  GaugeResult result = GaugeResult::kNothing;
  for (int k = 0; k < 60 && result == GaugeResult::kNothing; ++k) {
    device.Send("0.5 mm\r\n");
    result = gauge.Read(0.1, reading_m);
    SleepSeconds(0.06);
  }
  CHECK(result == GaugeResult::kUnreadable);
  CHECK(std::string(gauge.problem()).find("it sends without pause") != std::string::npos);
}

TEST_CASE("the unit of the line outranks the configured one, which applies where none is sent") {
  const test::FakeGauge device;
  Gauge gauge = GaugeAt(device.device(), "plain", GaugeUnit::kInch);
  Settle(gauge);
  double reading_m = 0;
  device.Send("0.1\r");
  REQUIRE(gauge.Read(0.5, reading_m) == GaugeResult::kReading);
  CHECK(reading_m == Approx(0.00254));
  device.Send("0.1 mm\r");
  REQUIRE(gauge.Read(0.5, reading_m) == GaugeResult::kReading);
  CHECK(reading_m == Approx(1e-4));
}

TEST_CASE("faults and unreadable lines are reported with the line and the remedy") {
  const test::FakeGauge device;
  Gauge gauge = GaugeAt(device.device(), "sylvac");
  Settle(gauge);
  double reading_m = 0;
  device.Send("ERR3\r");
  REQUIRE(gauge.Read(0.5, reading_m) == GaugeResult::kFault);
  CHECK(std::string(gauge.problem()).find("ERR3: the reading is out of its range") !=
        std::string::npos);
  device.Send("\x01garbage\r");
  REQUIRE(gauge.Read(0.5, reading_m) == GaugeResult::kUnreadable);
  CHECK(std::string(gauge.problem())
            .find("\"?garbage\" is not a line of the format \"sylvac\"; check `format`, `baud` "
                  "and `parity` of [[gauge]] (now 4800 7E2)") != std::string::npos);
}

TEST_CASE("data without the end of a line are reported once, not taken for silence") {
  const test::FakeGauge device;
  Gauge gauge = GaugeAt(device.device(), "plain");
  Settle(gauge);
  double reading_m = 0;
  const auto count_reports = [&] {
    int reports = 0;
    for (int k = 0; k < 4; ++k) {
      device.Send(std::string(40, '\xF5'));
      reports += gauge.Read(0.1, reading_m) == GaugeResult::kUnreadable ? 1 : 0;
    }
    return reports;
  };
  CHECK(count_reports() == 1);
  CHECK(std::string(gauge.problem())
            .find("unreadable data: \"????????????????????????...\", which goes on without the end "
                  "of a line, is not a line of the format \"plain\"") != std::string::npos);
  CHECK(count_reports() == 0);
  device.Send("\r\n");
  CHECK(gauge.Read(0.5, reading_m) == GaugeResult::kUnreadable);
  device.Send("0.5\r\n");
  CHECK(gauge.Read(0.5, reading_m) == GaugeResult::kReading);
}

TEST_CASE("a gauge that is unplugged is found again under its name") {
  auto device = std::make_unique<test::FakeGauge>();
  const std::string link = "/tmp/plumbline_gauge_" + std::to_string(getpid());
  REQUIRE(symlink(device->device().c_str(), link.c_str()) == 0);
  Gauge gauge = GaugeAt(link, "plain");
  Settle(gauge);
  device.reset();
  double reading_m = 0;
  REQUIRE(gauge.Read(0.5, reading_m) == GaugeResult::kLost);
  CHECK_FALSE(gauge.connected());
  CHECK(gauge.Read(0.5, reading_m) == GaugeResult::kWaiting);
  SleepSeconds(0.15);
  CHECK(gauge.Read(0.5, reading_m) == GaugeResult::kLost);  // the name leads nowhere
  CHECK(std::string(gauge.problem()).find("is the adapter plugged in") != std::string::npos);
  device = std::make_unique<test::FakeGauge>();
  unlink(link.c_str());
  REQUIRE(symlink(device->device().c_str(), link.c_str()) == 0);
  SleepSeconds(0.3);
  Settle(gauge);
  device->Send("1.5\r");
  REQUIRE(gauge.Read(0.5, reading_m) == GaugeResult::kReading);
  CHECK(reading_m == Approx(1.5e-3));
  unlink(link.c_str());
}

}  // namespace plumbline::serial_gauge_test
