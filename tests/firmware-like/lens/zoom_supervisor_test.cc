#include "firmware-like/lens/zoom_supervisor.h"

#include <catch2/catch.hpp>
#include <limits>

namespace plumbline::zoom_supervisor_test {

using namespace plumbline::lens;

namespace {

using Kind = ZoomEvent::Kind;

/// A supervisor and its clock; readings every 0.1 s.
class Bench {
 public:
  explicit Bench(const ZoomSupervisorSettings& settings = {}) : machine(settings) {}

  std::optional<ZoomTransition> Send(Kind kind, double after_s = 0.01) {
    ZoomEvent event;
    event.kind = kind;
    event.time_s = now_s += after_s;
    event.observed_s = now_s;
    return machine.Handle(event);
  }
  std::optional<ZoomTransition> Read(std::int32_t counts, LensMotion motion = LensMotion::kUnknown,
                                     std::optional<std::int32_t> focus = std::nullopt) {
    ZoomReading reading;
    reading.zoom_counts = counts;
    reading.focus_counts = focus;
    reading.motion = motion;
    return Read(reading);
  }
  std::optional<ZoomTransition> Read(const ZoomReading& reading) {
    ZoomEvent event;
    event.kind = Kind::kReading;
    event.time_s = now_s += 0.1;
    event.reading = reading;
    return machine.Handle(event);
  }
  void Settle(std::int32_t counts) {
    for (int i = 0; i < 5; ++i) Read(counts);
  }
  void MakeValid(std::int32_t counts) {
    Settle(counts);
    Send(Kind::kLensKnown);
    Send(Kind::kTagsGood);
    REQUIRE(machine.state() == ZoomState::kValid);
  }

  double now_s = 50;
  ZoomSupervisor machine;
};

}  // namespace

TEST_CASE("a known zoom is verified in four steps, each requesting the next") {
  Bench bench;
  CHECK(bench.machine.state() == ZoomState::kUnknown);
  CHECK(bench.Read(4000)->why == ZoomReason::kPositionReceived);
  CHECK_FALSE(bench.Read(4000));
  CHECK_FALSE(bench.Read(4001));
  const auto stationary = bench.Read(4000);
  REQUIRE(stationary);
  CHECK(stationary->to == ZoomState::kVerifying);
  CHECK(stationary->zoom_counts == 4000);
  CHECK(bench.machine.request() == ZoomRequest::kLoadLens);
  bench.Send(Kind::kLensKnown);
  CHECK(bench.machine.request() == ZoomRequest::kVerifyTags);
  bench.Send(Kind::kTagsNotVisible);
  CHECK(bench.machine.state() == ZoomState::kVerifying);
  const auto good = bench.Send(Kind::kTagsGood);
  REQUIRE(good);
  CHECK(good->from == ZoomState::kVerifying);
  CHECK(good->to == ZoomState::kValid);
  CHECK(good->why == ZoomReason::kTagsGood);
  CHECK(bench.machine.request() == ZoomRequest::kNothing);
  for (int i = 0; i < 100; ++i) CHECK_FALSE(bench.Read(3999 + i % 3));  // encoder noise
  CHECK_FALSE(bench.Send(Kind::kTagsNotVisible));
  CHECK_FALSE(bench.Send(Kind::kTagsGood));
}

TEST_CASE("after zooming in and back, the lens is verified again") {
  Bench bench;
  bench.MakeValid(4000);
  const auto moved = bench.Read(4003);
  REQUIRE(moved);
  CHECK(moved->to == ZoomState::kMoving);
  CHECK(moved->why == ZoomReason::kZoomChanged);
  CHECK_FALSE(bench.Send(Kind::kTagsGood));  // image taken during motion
  bench.Settle(4000);
  CHECK(bench.machine.state() == ZoomState::kVerifying);
  CHECK_FALSE(bench.Send(Kind::kTagsGood));  // no lens loaded yet
  bench.Send(Kind::kLensKnown);
  CHECK(bench.Send(Kind::kTagsGood)->to == ZoomState::kValid);
}

TEST_CASE("slow creep of the zoom and a changed focus are detected") {
  Bench bench;
  bench.MakeValid(4000);
  CHECK_FALSE(bench.Read(4001));
  CHECK_FALSE(bench.Read(4002));
  CHECK(bench.Read(4003)->to == ZoomState::kMoving);

  Bench focus;
  for (int i = 0; i < 5; ++i) focus.Read(4000, LensMotion::kSettled, 77);
  focus.Send(Kind::kLensKnown);
  focus.Send(Kind::kTagsGood);
  CHECK_FALSE(focus.Read(4000, LensMotion::kSettled, 81));
  CHECK(focus.Read(4000, LensMotion::kSettled, 82)->why == ZoomReason::kFocusChanged);
}

TEST_CASE("a lens that the device reports as moving does not settle, even with constant counts") {
  Bench bench;
  for (int i = 0; i < 20; ++i) bench.Read(4000, LensMotion::kMoving);
  CHECK(bench.machine.state() == ZoomState::kMoving);
  bench.Read(4000, LensMotion::kSettled);
  bench.Read(4000, LensMotion::kSettled);
  CHECK(bench.machine.state() == ZoomState::kMoving);
  bench.Read(4000, LensMotion::kSettled);
  CHECK(bench.machine.state() == ZoomState::kVerifying);
}

TEST_CASE(
    "an unknown zoom requests the board; an accepted calibration is valid, a refused one is not") {
  Bench bench;
  bench.Settle(8000);
  CHECK(bench.Send(Kind::kLensUnknown)->to == ZoomState::kStale);
  CHECK(bench.machine.request() == ZoomRequest::kBoard);
  CHECK(bench.Send(Kind::kBoardStarted)->to == ZoomState::kCalibrating);
  CHECK(bench.Send(Kind::kBoardRefused)->to == ZoomState::kRefused);
  CHECK(bench.machine.request() == ZoomRequest::kBoard);
  bench.Send(Kind::kBoardStarted);
  CHECK(bench.Send(Kind::kBoardAccepted)->to == ZoomState::kValid);
  bench.Send(Kind::kBoardStarted);
  CHECK(bench.machine.state() == ZoomState::kCalibrating);
  CHECK(bench.Send(Kind::kBoardCancelled)->to == ZoomState::kVerifying);  // the lens remains loaded
}

TEST_CASE("motion ends a capture, and its late result is ignored") {
  Bench bench;
  bench.Settle(8000);
  bench.Send(Kind::kBoardStarted);
  CHECK(bench.Read(8010)->from == ZoomState::kCalibrating);
  CHECK_FALSE(bench.Send(Kind::kBoardAccepted));
  CHECK_FALSE(bench.Send(Kind::kBoardStarted));  // it still moves
  bench.Settle(8010);
  bench.Send(Kind::kBoardStarted);
  ZoomEvent old;
  old.kind = Kind::kBoardAccepted;
  old.time_s = bench.now_s;
  old.observed_s = bench.now_s - 2;
  CHECK(bench.machine.Handle(old)->why == ZoomReason::kImagesTooOld);
}

TEST_CASE("digital zoom is refused until it is off and the lens has been stationary") {
  Bench bench;
  bench.MakeValid(100);
  ZoomReading digital;
  digital.zoom_counts = 100;
  digital.digital_zoom = true;
  CHECK(bench.Read(digital)->to == ZoomState::kRefused);
  CHECK_FALSE(bench.Send(Kind::kBoardStarted));
  CHECK_FALSE(bench.Read(100));  // a reading without this field changes nothing
  digital.digital_zoom = false;
  CHECK(bench.Read(digital)->to == ZoomState::kMoving);
  bench.Settle(100);
  CHECK(bench.machine.state() == ZoomState::kVerifying);
}

TEST_CASE("a lost sensor leads to kUnknown after lost_after_s; a short gap has no effect") {
  Bench bench;
  bench.MakeValid(100);
  for (int i = 0; i < 8; ++i) CHECK_FALSE(bench.Send(Kind::kLost, 0.1));
  CHECK_FALSE(bench.Read(100));
  for (int i = 0; i < 9; ++i) CHECK_FALSE(bench.Send(Kind::kLost, 0.1));
  CHECK(bench.Send(Kind::kTime, 0.2)->why == ZoomReason::kSensorLost);
  CHECK(bench.machine.state() == ZoomState::kUnknown);
  bench.Settle(100);
  CHECK(bench.machine.state() == ZoomState::kVerifying);
}

TEST_CASE("readings that no longer contain the position count as a lost sensor") {
  Bench bench;
  bench.MakeValid(100);
  for (int i = 0; i < 12; ++i) bench.Read(ZoomReading{});
  CHECK(bench.machine.state() == ZoomState::kUnknown);
}

TEST_CASE("with a sensor that only signals motion, tags are verified after each motion") {
  Bench bench;
  ZoomReading still, moved;
  moved.moved = true;
  for (int i = 0; i < 5; ++i) bench.Read(still);
  bench.Send(Kind::kLensKnown);
  CHECK(bench.Send(Kind::kTagsGood)->to == ZoomState::kValid);
  CHECK(bench.Read(moved)->why == ZoomReason::kDeviceMoves);
  for (int i = 0; i < 5; ++i) bench.Read(still);
  CHECK(bench.machine.request() == ZoomRequest::kLoadLens);
}

TEST_CASE("a failed tag check requests the board; a later good one makes the lens valid again") {
  Bench bench;
  bench.MakeValid(100);
  CHECK(bench.Send(Kind::kTagsBad)->to == ZoomState::kStale);
  CHECK(bench.machine.request() == ZoomRequest::kBoard);
  CHECK(bench.Send(Kind::kTagsGood)->to == ZoomState::kValid);
}

TEST_CASE("a calibration that the tags contradict from the start does not request another one") {
  Bench bench;
  bench.Settle(100);
  bench.Send(Kind::kLensUnknown);
  CHECK(bench.machine.request() == ZoomRequest::kBoard);
  bench.Send(Kind::kBoardStarted);
  CHECK(bench.Send(Kind::kBoardAccepted)->to == ZoomState::kValid);
  const auto bad = bench.Send(Kind::kTagsBad);
  CHECK(bad->to == ZoomState::kStale);
  CHECK(bad->why == ZoomReason::kTagsContradict);
  for (int i = 0; i < 100; ++i) {
    bench.Read(100);
    bench.Send(i % 3 == 0 ? Kind::kTagsNotVisible : Kind::kTagsBad);
    CHECK(bench.machine.request() == ZoomRequest::kNothing);
    CHECK(bench.machine.state() == ZoomState::kStale);
  }
  SECTION("until the tags have agreed") {
    CHECK(bench.Send(Kind::kTagsGood)->to == ZoomState::kValid);
    CHECK(bench.Send(Kind::kTagsBad)->why == ZoomReason::kTagsBad);
    CHECK(bench.machine.request() == ZoomRequest::kBoard);
  }
  SECTION("until the zoom moves") {
    bench.Settle(200);
    bench.Send(Kind::kLensKnown);
    CHECK(bench.Send(Kind::kTagsBad)->why == ZoomReason::kTagsBad);
    CHECK(bench.machine.request() == ZoomRequest::kBoard);
  }
  SECTION("but the operator can start one") {
    CHECK(bench.Send(Kind::kBoardStarted)->to == ZoomState::kCalibrating);
    CHECK(bench.Send(Kind::kBoardAccepted)->to == ZoomState::kValid);
    CHECK(bench.Send(Kind::kTagsBad)->why == ZoomReason::kTagsContradict);
  }
  SECTION("nor after a restart, if the contradiction is known") {
    Bench restarted;
    restarted.Settle(100);
    ZoomEvent known;
    known.kind = Kind::kLensKnown;
    known.time_s = known.observed_s = restarted.now_s;
    known.contradicted = true;
    restarted.machine.Handle(known);
    CHECK(restarted.Send(Kind::kTagsBad)->why == ZoomReason::kTagsContradict);
    CHECK(restarted.machine.request() == ZoomRequest::kNothing);
  }
}

TEST_CASE("unanswered tag checks and hidden tags lead to a request for the board") {
  for (const bool hidden : {false, true}) {
    Bench bench;
    bench.Settle(100);
    bench.Send(Kind::kLensKnown);
    for (int i = 0; i < 60; ++i) {
      bench.Read(100);
      if (hidden) bench.Send(Kind::kTagsNotVisible);
    }
    CHECK(bench.machine.state() == ZoomState::kStale);
    CHECK(bench.machine.reason() == (hidden ? ZoomReason::kTagsNotVisible : ZoomReason::kNoAnswer));
    CHECK(bench.machine.request() == ZoomRequest::kBoard);
    CHECK(bench.Send(Kind::kTagsGood)->to == ZoomState::kValid);
  }
}

TEST_CASE("the dead band follows the focal length per count, and is provided with the lens") {
  CHECK(DeadBandCounts(1e-4, 5e-4) == 5);
  CHECK(DeadBandCounts(-1e-4, 4.9e-4) == 4);
  CHECK(DeadBandCounts(5e-4, 5e-4) == 1);
  CHECK(DeadBandCounts(1, 5e-4) == 1);
  CHECK(DeadBandCounts(0, 5e-4) == 1'000'000);
  CHECK(DeadBandCounts(std::numeric_limits<double>::quiet_NaN(), 5e-4) == 1);

  Bench bench;
  bench.Settle(100);
  ZoomEvent known;
  known.kind = Kind::kLensKnown;
  known.time_s = known.observed_s = bench.now_s;
  known.zoom_band_counts = 7;
  bench.machine.Handle(known);
  bench.Send(Kind::kTagsGood);
  CHECK_FALSE(bench.Read(107));
  CHECK(bench.Read(108)->to == ZoomState::kMoving);
}

TEST_CASE("times that are not finite, run backwards or lie in the future make nothing valid") {
  Bench bench;
  bench.Settle(100);
  bench.Send(Kind::kLensKnown);
  for (const double observed_s : {std::numeric_limits<double>::quiet_NaN(),
                                  std::numeric_limits<double>::infinity(), bench.now_s + 1}) {
    ZoomEvent event;
    event.kind = Kind::kTagsGood;
    event.time_s = std::numeric_limits<double>::quiet_NaN();
    event.observed_s = observed_s;
    CHECK_FALSE(bench.machine.Handle(event));
  }
  CHECK(bench.machine.state() == ZoomState::kVerifying);
  ZoomEvent back;
  back.kind = Kind::kTime;
  back.time_s = 1;
  CHECK_FALSE(bench.machine.Handle(back));
  CHECK(bench.Send(Kind::kTagsGood)->time_s == bench.now_s);
}

TEST_CASE("extreme counts do not overflow") {
  Bench bench;
  bench.MakeValid(std::numeric_limits<std::int32_t>::min());
  CHECK(bench.Read(std::numeric_limits<std::int32_t>::max())->to == ZoomState::kMoving);
}

}  // namespace plumbline::zoom_supervisor_test
