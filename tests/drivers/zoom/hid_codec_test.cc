#include "drivers/zoom/hid_codec.h"

#include <catch2/catch.hpp>
#include <random>

namespace plumbline::hid_codec_test {

using namespace plumbline::zoom;

namespace {

using Meaning = HidField::Meaning;
using Bytes = std::vector<std::uint8_t>;

HidProfile GoodProfile() {
  HidProfile profile;
  HidExchange exchange;
  exchange.send = {{0x11}};
  exchange.answer_id = 0x13;
  exchange.answer_bytes = 8;
  exchange.count_at = 1;
  exchange.count = 4;
  exchange.fields = {{Meaning::kZoomCounts, 2, 2, true, false, 0xFFFFFFFF},
                     {Meaning::kFocusCounts, 4, 2, false, true, 0xFFFFFFFF},
                     {Meaning::kMoving, 6, 1, true, false, 0x02},
                     {Meaning::kDigitalZoom, 6, 1, true, false, 0x04},
                     {Meaning::kMoved, 7, 1, true, false, 0xFFFFFFFF}};
  profile.exchanges = {exchange};
  return profile;
}

}  // namespace

TEST_CASE("fields are decoded by offset, byte order, sign and mask") {
  const HidProfile profile = GoodProfile();
  REQUIRE_FALSE(FaultOf(profile));
  lens::ZoomReading reading;
  REQUIRE(ReadingFromReport(profile.exchanges[0], Bytes{0x13, 4, 0x12, 0x34, 0xFE, 0xFF, 0x02, 0},
                            reading) == HidAnswer::kRead);
  CHECK(reading.zoom_counts == 0x1234);
  CHECK(reading.focus_counts == -2);
  CHECK(reading.motion == lens::LensMotion::kMoving);
  CHECK(reading.digital_zoom == false);
  CHECK_FALSE(reading.moved);
  REQUIRE(ReadingFromReport(profile.exchanges[0], Bytes{0x13, 4, 0xFF, 0xFF, 0, 0x80, 0x05, 9},
                            reading) == HidAnswer::kRead);
  CHECK(reading.zoom_counts == 0xFFFF);
  CHECK(reading.focus_counts == -32768);
  CHECK(reading.motion == lens::LensMotion::kSettled);
  CHECK(reading.digital_zoom == true);
  CHECK(reading.moved);

  HidExchange wide = profile.exchanges[0];
  wide.fields = {{Meaning::kZoomCounts, 2, 4, false, true, 0xFFFFFFFF}};
  REQUIRE(ReadingFromReport(wide, Bytes{0x13, 4, 0xFF, 0xFF, 0xFF, 0xFF, 0, 0}, reading) ==
          HidAnswer::kRead);
  CHECK(reading.zoom_counts == -1);
}

TEST_CASE("short, other and not yet ready reports leave the reading unchanged") {
  const HidProfile profile = GoodProfile();
  lens::ZoomReading reading;
  const auto read = [&](const Bytes& report) {
    return ReadingFromReport(profile.exchanges[0], report, reading);
  };
  CHECK(read({}) == HidAnswer::kShort);
  CHECK(read({0x13, 4, 1, 2, 3, 4, 5}) == HidAnswer::kShort);
  CHECK(read({0x12, 4, 1, 2, 3, 4, 5, 6}) == HidAnswer::kOther);
  CHECK(read({0x13, 3, 1, 2, 3, 4, 5, 6}) == HidAnswer::kNotReady);
  CHECK_FALSE(reading.zoom_counts);
  CHECK(read({0x13, 4, 1, 2, 3, 4, 5, 6, 7, 8, 9}) == HidAnswer::kRead);  // extra bytes are ignored
}

TEST_CASE("faults of a profile are reported") {
  struct Case {
    void (*spoil)(HidProfile&);
    const char* fault;
  };
  const Case cases[] = {
      {[](HidProfile& p) { p.exchanges.clear(); }, "no exchange"},
      {[](HidProfile& p) { p.exchanges[0].answer_bytes = 0; }, "is outside 1..64"},
      {[](HidProfile& p) { p.exchanges[0].answer_bytes = 65; }, "is outside 1..64"},
      {[](HidProfile& p) { p.exchanges[0].send = {{}}; }, "output report of 0 bytes"},
      {[](HidProfile& p) { p.exchanges[0].count_at = 8; }, "the count lies outside"},
      {[](HidProfile& p) { p.exchanges[0].fields.clear(); }, "has no fields"},
      {[](HidProfile& p) { p.exchanges[0].fields[0].bytes = 3; }, "3 bytes is not"},
      {[](HidProfile& p) { p.exchanges[0].fields[0].at = 7; }, "at 7 lies outside"},
      {[](HidProfile& p) { p.exchanges[0].fields[0].at = -1; }, "at -1 lies outside"},
      {[](HidProfile& p) { p.exchanges[0].fields[0].mask = 0; }, "the mask of a field is 0"},
      {[](HidProfile& p) { p.exchanges[0].fields[1].meaning = Meaning::kMoved; }, "reported twice"},
      {[](HidProfile& p) { p.exchanges[0].fields = {p.exchanges[0].fields[3]}; }, "neither"},
      {[](HidProfile& p) {
         p.exchanges.push_back(p.exchanges[0]);
         p.exchanges[0].send.clear();
       },
       "reports unsolicited"},
  };
  for (const Case& c : cases) {
    HidProfile profile = GoodProfile();
    c.spoil(profile);
    const auto fault = FaultOf(profile);
    REQUIRE(fault);
    CHECK_THAT(*fault, Catch::Contains(c.fault));
  }
}

TEST_CASE("any report of any length is either decoded or rejected") {
  const HidProfile profile = GoodProfile();
  std::mt19937 random(3);
  for (int run = 0; run < 20000; ++run) {
    Bytes report(random() % 70);
    for (std::uint8_t& byte : report) byte = static_cast<std::uint8_t>(random());
    if (!report.empty() && random() % 2 == 0) report[0] = 0x13;
    lens::ZoomReading reading;
    const HidAnswer answer = ReadingFromReport(profile.exchanges[0], report, reading);
    REQUIRE((answer == HidAnswer::kRead) == reading.zoom_counts.has_value());
    if (answer == HidAnswer::kRead) REQUIRE(report.size() >= 8);
  }
}

}  // namespace plumbline::hid_codec_test
