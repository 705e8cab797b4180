#include "drivers/zoom/replay_zoom.h"

#include <catch2/catch.hpp>

#include "drivers/zoom/registry.h"

namespace plumbline::replay_zoom_test {

using namespace plumbline::zoom;

namespace {

double now_s = 0;
double TestClock() {
  return now_s;
}

}  // namespace

TEST_CASE("a table: columns in any order, empty fields, CRLF, blank lines") {
  const auto rows = ZoomRowsFromCsv(
      "zoom_counts,t_s,moving,digital_zoom,moved,lost,focus_counts\r\n"
      "100,0.5,,,,,\r\n\r\n-3, 1e0 ,1,0,1,0,77\n,2,0,1,,1,\n");
  REQUIRE(rows);
  REQUIRE(rows->size() == 3);
  CHECK((*rows)[0].t_s == 0.5);
  CHECK((*rows)[0].reading.zoom_counts == 100);
  CHECK((*rows)[0].reading.motion == lens::LensMotion::kUnknown);
  CHECK_FALSE((*rows)[0].reading.digital_zoom);
  CHECK((*rows)[1].reading.zoom_counts == -3);
  CHECK((*rows)[1].reading.focus_counts == 77);
  CHECK((*rows)[1].reading.motion == lens::LensMotion::kMoving);
  CHECK((*rows)[1].reading.moved);
  CHECK_FALSE((*rows)[2].reading.zoom_counts);
  CHECK((*rows)[2].reading.digital_zoom == true);
  CHECK((*rows)[2].lost);
}

TEST_CASE("a faulty table is rejected with the line") {
  struct Case {
    const char* csv;
    const char* fault;
  };
  for (const Case& c : {Case{"", "unknown column"}, Case{"t_s\n", "zoom_counts is missing"},
                        Case{"zoom_counts\n", "t_s is missing"},
                        Case{"t_s,zoom_counts,colour\n", "unknown column colour"},
                        Case{"t_s,zoom_counts,t_s\n", "t_s occurs twice"},
                        Case{"t_s,zoom_counts\n1,2\n3\n", "line 3: 1 fields"},
                        Case{"t_s,zoom_counts\n1,2.5\n", "line 2: 2.5 is not a valid zoom_counts"},
                        Case{"t_s,zoom_counts\n,2\n", "line 2:  is not a valid t_s"},
                        Case{"t_s,zoom_counts\nnan,2\n", "line 2: nan is not a valid t_s"},
                        Case{"t_s,zoom_counts\n1,99999999999\n", "is not a valid zoom_counts"},
                        Case{"t_s,zoom_counts,moving\n1,2,3\n", "3 is not a valid moving"}}) {
    const auto rows = ZoomRowsFromCsv(c.csv);
    CAPTURE(c.csv);
    REQUIRE_FALSE(rows.ok());
    CHECK_THAT(rows.error(), Catch::Contains(c.fault));
  }
}

TEST_CASE("rows follow the clock; the last one is held; motion between two readings is reported") {
  const auto rows = ZoomRowsFromCsv(
      "t_s,zoom_counts,moved,lost\n10,1,0,0\n10.1,2,1,0\n10.2,3,0,0\n10.3,,0,1\n10.4,4,0,0\n");
  REQUIRE(rows);
  now_s = 1000;
  auto made = ReplayZoom::Create(*rows, TestClock);
  REQUIRE(made);
  const auto sensor = std::move(made).value();
  lens::ZoomReading reading;
  REQUIRE(sensor->Read(reading) == ZoomResult::kOk);
  CHECK(reading.zoom_counts == 1);
  CHECK(reading.time_s == 1000);
  now_s = 1000.25;
  REQUIRE(sensor->Read(reading) == ZoomResult::kOk);
  CHECK(reading.zoom_counts == 3);
  CHECK(reading.moved);
  now_s = 1000.35;
  CHECK(sensor->Read(reading) == ZoomResult::kTimeout);
  CHECK(reading.zoom_counts == 3);
  now_s = 2000;
  REQUIRE(sensor->Read(reading) == ZoomResult::kOk);
  CHECK(reading.zoom_counts == 4);
  CHECK_FALSE(reading.moved);

  CHECK_FALSE(ReplayZoom::Create({}, TestClock).ok());
  CHECK_FALSE(ReplayZoom::Create({ZoomRow{1, {}, false}, ZoomRow{1, {}, false}}, TestClock).ok());
}

TEST_CASE("the registry lists and creates each kind") {
  ZoomConnection connection;
  connection.replay = {ZoomRow{}};
  connection.visca.device = "/dev/null";
  HidExchange exchange;
  exchange.answer_bytes = 2;
  exchange.fields = {HidField{}};
  connection.hid.profile.exchanges = {exchange};
  CHECK(ZoomKinds().size() == 5);
  for (const ZoomKind* kind : ZoomKinds()) {
    CAPTURE(kind->name);
    CHECK(kind->make(connection).ok());
    CHECK(FindZoomKind(kind->name) == kind);
  }
  CHECK(FindZoomKind("telepathy") == nullptr);
}

TEST_CASE("the back-off grows after each failure and restarts after success") {
  BackOff back_off;
  CHECK(back_off.Due(0));
  double wait_s = 0.1;
  for (int i = 0; i < 8; ++i) {
    back_off.Failed(100);
    CHECK_FALSE(back_off.Due(100 + 0.99 * wait_s));
    CHECK(back_off.Due(100 + 1.01 * wait_s));
    wait_s = std::min(2 * wait_s, 1.0);
  }
  back_off.Well();
  back_off.Failed(100);
  CHECK(back_off.Due(100.11));
}

}  // namespace plumbline::replay_zoom_test
