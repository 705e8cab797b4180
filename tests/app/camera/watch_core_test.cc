#include "app/camera/watch_core.h"

#include <catch2/catch.hpp>

#include "tests/app/camera/marks_scene.h"

using namespace plumbline;
using namespace plumbline::test;

namespace {

/// The core with a clock of the test's own and a cell that it can look at.
struct Watch {
  std::vector<std::string> log;
  Body cell = CellMarks();
  Body gripper{"gripper",
               {{20, 0.06, {Mat3::Identity(), Vec3(-0.1, 0, 0)}},
                {21, 0.06, {Mat3::Identity(), Vec3(0.1, 0.05, 0.01)}}}};
  Pose X_CK = CellInCamera();
  Pose X_CT{Mat3::Identity(), Vec3(0.05, 0.02, 1.45)};
  Lens real = MarksLens();
  double now_s = 100;
  std::int32_t zoom = 4000;
  std::uint64_t look_number = 0;
  WatchCore core;

  Watch() : core(Settings(), [this](const LogEntry& entry) { log.push_back(entry.text); }) {}

  WatchSettings Settings() const {
    WatchSettings settings;
    settings.cell = cell;
    settings.bodies = {"cell", "gripper"};
    settings.tool = "gripper";
    settings.tip_T = Vec3(0.2, 0, 0);
    settings.X_WK.p = Vec3(1, 2, 3);
    return settings;
  }
  void Reading(double after_s = 0.1) {
    now_s += after_s;
    ZoomReading reading;
    reading.zoom_counts = zoom;
    reading.time_s = now_s;
    core.TakeReading(reading, now_s);
  }
  void Stand() {
    for (int k = 0; k < 6; ++k) Reading();
  }
  static std::shared_ptr<LensInUse> LensOf(const Lens& lens, std::int64_t id) {
    auto in_use = std::make_shared<LensInUse>();
    in_use->known.lens = lens;
    in_use->known.covariance.diagonal() << 0.25, 0.25, 1, 1, 1e-8, 1e-8, 1e-12, 1e-12, 0;
    in_use->known.size = {1920, 1080};
    in_use->calibrated = true;
    in_use->id = id;
    return in_use;
  }
  void Load(std::shared_ptr<const LensInUse> lens) {
    const WatchOrders asked = core.orders();
    REQUIRE(asked.look_up);
    core.TakeLens(std::move(lens), nullptr, asked, now_s, now_s + 0.01);
    now_s += 0.02;
  }
  /// One image: marks looked at, bodies told.
  bool Look(bool hidden = false) {
    Reading(0.05);
    const WatchOrders asked = core.orders();
    if (!asked.lens) return false;
    std::vector<SeenTag> seen;
    if (!hidden) seen = SeenMarks(real, cell, X_CK, 0.05, 2 * ++look_number);
    for (const SeenTag& tag : SeenMarks(real, gripper, X_CT, 0.05, 2 * look_number + 1)) {
      seen.push_back(tag);
    }
    const MarksLook look = LookAtMarks(*asked.lens, asked.memory.get(), cell, seen, 0.5);
    const bool changed = core.TakeLook(look, asked, now_s - 0.01, now_s);
    std::vector<SeenBody> bodies;
    for (const Body* body : {&cell, &gripper}) {
      if (auto located = LocateBody(asked.lens->known, *body, seen, std::nullopt)) {
        bodies.push_back(*located);
      }
    }
    core.TakeBodies(bodies, asked, now_s - 0.01);
    return changed;
  }
  void Valid() {
    Stand();
    Load(LensOf(real, 7));
    Look();
    REQUIRE(core.state() == ZoomState::kValid);
    for (int k = 0; k < 4; ++k) Look();
  }
  bool Says(const std::string& text) const {
    return std::any_of(log.begin(), log.end(), [&](const std::string& line) {
      return line.find(text) != std::string::npos;
    });
  }
};

}  // namespace

TEST_CASE("from the first word of the sensor to bodies and tip in the measurement frame") {
  Watch watch;
  CHECK(watch.core.Status().configured);
  CHECK(watch.core.Status().lens_stale);
  CHECK(watch.core.Status().camera_lost);
  watch.core.TakeCameraResult(CameraResult::kFrame, "", watch.now_s);
  watch.Valid();
  const CameraStatus told = watch.core.Status();
  CHECK_FALSE(told.lens_stale);
  CHECK_FALSE(told.camera_lost);
  CHECK_FALSE(told.zoom_unknown);
  CHECK_FALSE(told.board_wanted);
  CHECK(told.lens_id == 7);
  CHECK(told.zoom_counts == 4000);
  REQUIRE(told.bodies[1].valid);
  const Vec3 truth = Vec3(1, 2, 3) + watch.X_CK.Inverse() * (watch.X_CT * Vec3(0, 0, 0));
  CHECK((told.bodies[1].X_WK.p - truth).norm() < 2 * told.bodies[1].radius_m);
  REQUIRE(told.tip_valid);
  const Vec3 tip = Vec3(1, 2, 3) + watch.X_CK.Inverse() * (watch.X_CT * Vec3(0.2, 0, 0));
  CHECK((told.tip_W - tip).norm() < 5e-3);
  CHECK(watch.Says("camera valid: the reference tags are where they should be (zoom 4000)"));
}

TEST_CASE("one reading that differs makes everything stale, and a known lens brings it back") {
  Watch watch;
  watch.core.TakeCameraResult(CameraResult::kFrame, "", watch.now_s);
  watch.Valid();
  watch.zoom = 5000;
  watch.Reading();
  CameraStatus told = watch.core.Status();
  CHECK(told.state == ZoomState::kMoving);
  CHECK(watch.core.Status().lens_stale);
  CHECK_FALSE(told.tip_valid);
  CHECK_FALSE(told.bodies[0].valid);
  CHECK(told.lens_id == 0);
  CHECK_FALSE(watch.core.orders().lens);
  watch.Stand();
  watch.real.fx *= 1.2;
  watch.real.fy *= 1.2;
  watch.Load(Watch::LensOf(watch.real, 8));
  watch.Look();
  CHECK(watch.core.Status().state == ZoomState::kValid);
  CHECK(watch.core.Status().lens_id == 8);
}

TEST_CASE("answers about a lens that has moved since are not believed") {
  Watch watch;
  watch.Stand();
  const WatchOrders asked = watch.core.orders();
  const double asked_s = watch.now_s;
  watch.zoom = 5000;
  watch.Stand();
  watch.core.TakeLens(Watch::LensOf(watch.real, 7), nullptr, asked, asked_s, watch.now_s);
  CHECK_FALSE(watch.core.orders().lens);
  CHECK(watch.core.orders().look_up);
  watch.Load(Watch::LensOf(watch.real, 8));
  const WatchOrders of_eight = watch.core.orders();
  MarksLook good;
  good.verdict = MarksVerdict::kGood;
  watch.core.TakeLook(good, of_eight, asked_s, watch.now_s);  // an image from before
  CHECK(watch.core.state() == ZoomState::kVerifying);
  watch.core.TakeLook(good, asked, watch.now_s, watch.now_s);  // with another lens
  CHECK(watch.core.state() == ZoomState::kVerifying);
  watch.core.TakeLook(good, of_eight, watch.now_s, watch.now_s);
  CHECK(watch.core.state() == ZoomState::kValid);
}

TEST_CASE("unknown zoom: the board is asked for, captured, accepted; the tracker goes on") {
  Watch watch;
  watch.core.TakeCameraResult(CameraResult::kFrame, "", watch.now_s);
  watch.Stand();
  watch.Load(nullptr);
  CHECK(watch.core.state() == ZoomState::kStale);
  CHECK(watch.core.orders().want_board);
  CHECK_FALSE(watch.core.orders().look_up);
  CHECK(watch.core.Status().prompt == BoardPrompt::kShowBoard);
  CHECK(watch.core.Status().board_wanted);
  REQUIRE(watch.core.StartBoard(watch.now_s));
  const double began_s = watch.now_s;
  watch.core.TakeProgress(BoardPrompt::kTiltLeft, 3, watch.now_s += 0.5);
  CHECK(watch.core.Status().prompt == BoardPrompt::kTiltLeft);
  CHECK(watch.core.Status().board_views == 3);
  CHECK(watch.Says("tilt the board's left edge"));
  watch.Reading();
  SECTION("accepted") {
    REQUIRE(watch.core.TakeAccepted(*Watch::LensOf(watch.real, 0), began_s, watch.now_s));
    watch.core.NoteKept(9);
    CHECK(watch.core.Status().lens_id == 9);
    CHECK(watch.Look());  // the marks are remembered with the new lens
    CHECK_FALSE(watch.Look());
    CHECK(watch.core.state() == ZoomState::kValid);
    CHECK(watch.core.Status().board_views == 0);
  }
  SECTION("refused, with reasons; the board is still asked for") {
    watch.core.TakeRefused({"the board is not what it should be"}, watch.now_s);
    CHECK(watch.core.state() == ZoomState::kRefused);
    CHECK(watch.core.orders().want_board);
    CHECK(watch.Says("calibration refused: the board is not what it should be"));
  }
  SECTION("cancelled") {
    watch.core.CancelBoard(watch.now_s);
    CHECK(watch.core.state() == ZoomState::kStale);
  }
  SECTION("the zoom moved meanwhile: what comes too late is not taken") {
    watch.zoom = 100;
    watch.Reading();
    CHECK(watch.core.state() == ZoomState::kMoving);
    CHECK_FALSE(watch.core.TakeAccepted(*Watch::LensOf(watch.real, 0), began_s, watch.now_s));
    CHECK_FALSE(watch.core.StartBoard(watch.now_s));
    CHECK(watch.Says("no calibration now: the zoom changed"));
  }
}

TEST_CASE("a lens that was good stays while the board is refused or cancelled") {
  Watch watch;
  watch.core.TakeCameraResult(CameraResult::kFrame, "", watch.now_s);
  watch.Valid();
  REQUIRE(watch.core.StartBoard(watch.now_s));
  CHECK(watch.core.Status().lens_stale);
  watch.Reading();
  watch.core.TakeRefused({"blurred"}, watch.now_s);
  CHECK(watch.core.orders().lens->id == 7);
  watch.Look();
  CHECK(watch.core.state() == ZoomState::kValid);
}

TEST_CASE("marks: a hand in the picture is nothing, a drift is refined, a bad lens is stale") {
  Watch watch;
  watch.core.TakeCameraResult(CameraResult::kFrame, "", watch.now_s);
  watch.Valid();
  const Lens before = watch.real;
  SECTION("hidden") {
    for (int k = 0; k < 10; ++k) watch.Look(true);
    CHECK(watch.core.state() == ZoomState::kValid);
    CHECK_FALSE(watch.core.Status().tip_valid);  // the cell is not seen
  }
  SECTION("drift") {
    watch.real.fx *= 1.002;
    watch.real.fy *= 1.002;
    CHECK_FALSE(watch.Look());
    CHECK_FALSE(watch.core.Status().tip_valid);  // in doubt: nothing is measured
    CHECK_FALSE(watch.Look());
    CHECK(watch.Look());
    CHECK(watch.core.state() == ZoomState::kValid);
    CHECK(watch.core.orders().lens->known.lens.fx == Approx(1.002 * before.fx).epsilon(3e-4));
    CHECK(watch.Says("the zoom drifted"));
    for (int k = 0; k < 3; ++k) watch.Look();
    CHECK(watch.core.Status().tip_valid);
  }
  SECTION("the camera is pushed") {
    watch.X_CK.p.x() += 0.01;
    watch.X_CT.p.x() += 0.01;
    for (int k = 0; k < 8; ++k) watch.Look();
    CHECK(watch.core.state() == ZoomState::kValid);
    CHECK(watch.Says("the camera was moved by"));
    CHECK(watch.core.orders().lens->known.lens.fx == before.fx);
    CHECK(watch.core.Status().tip_valid);
  }
  SECTION("neither") {
    watch.real.k1 += 0.2;
    watch.real.cx += 30;
    for (int k = 0; k < 2; ++k) watch.Look();
    CHECK(watch.core.state() == ZoomState::kValid);
    watch.Look();
    CHECK(watch.core.state() == ZoomState::kStale);
    CHECK(watch.core.Status().board_wanted);
    CHECK(watch.Says("neither a drift"));
    const std::size_t lines = watch.log.size();
    for (int k = 0; k < 20; ++k) watch.Look();
    CHECK(watch.log.size() == lines);  // told once
    watch.real = before;
    for (int k = 0; k < 3; ++k) watch.Look();
    CHECK(watch.core.state() == ZoomState::kValid);
  }
}

TEST_CASE(
    "digital zoom: refused with the reason, no capture begins, the lens comes back after it") {
  Watch watch;
  watch.core.TakeCameraResult(CameraResult::kFrame, "", watch.now_s);
  watch.Valid();
  const auto read = [&](bool digital) {
    ZoomReading reading;
    reading.zoom_counts = watch.zoom;
    reading.digital_zoom = digital;
    watch.now_s += 0.1;
    reading.time_s = watch.now_s;
    watch.core.TakeReading(reading, watch.now_s);
  };
  read(true);
  CHECK(watch.core.state() == ZoomState::kRefused);
  CHECK(watch.core.Status().lens_stale);
  CHECK_FALSE(watch.core.Status().tip_valid);
  CHECK(watch.Says("camera refused: " + std::string(ZoomReasonText(ZoomReason::kDigitalZoom))));
  CHECK_FALSE(watch.core.StartBoard(watch.now_s));
  CHECK(watch.Says("no calibration now"));
  const std::size_t lines = watch.log.size();
  for (int k = 0; k < 10; ++k) read(true);
  CHECK(watch.log.size() == lines);  // told once
  for (int k = 0; k < 8; ++k) read(false);
  CHECK(watch.core.orders().look_up);
}

TEST_CASE("reports too short, answers from elsewhere: unknown, with the driver's words") {
  for (const auto& [result, words] :
       {std::pair{ZoomResult::kProtocol, "an answer of 2 bytes is too short"},
        {ZoomResult::kTimeout, "no answer, but camera 3 answered. Check camera.zoom.address."},
        {ZoomResult::kRefused, "reports an error: not executable (41)"}}) {
    Watch watch;
    watch.core.TakeCameraResult(CameraResult::kFrame, "", watch.now_s);
    watch.Valid();
    for (int k = 0; k < 30; ++k) watch.core.TakeSensorFault(result, words, watch.now_s += 0.1);
    CHECK(watch.core.state() == ZoomState::kUnknown);
    CHECK(watch.core.Status().zoom_unknown);
    CHECK_FALSE(watch.core.Status().tip_valid);
    CHECK(watch.Says(words));
  }
}

TEST_CASE("sensor and camera lost, and back: told once each") {
  Watch watch;
  watch.core.TakeCameraResult(CameraResult::kFrame, "", watch.now_s);
  watch.Valid();
  for (int k = 0; k < 30; ++k) {
    watch.core.TakeSensorFault(k % 2 == 0 ? ZoomResult::kTimeout : ZoomResult::kWaiting,
                               "no answer of camera 1; cable?", watch.now_s += 0.1);
  }
  CHECK(watch.core.state() == ZoomState::kUnknown);
  CHECK(watch.core.Status().zoom_unknown);
  CHECK(std::count_if(watch.log.begin(), watch.log.end(), [](const std::string& line) {
          return line.find("cable?") != std::string::npos;
        }) == 1);
  watch.Stand();
  CHECK(watch.Says("zoom sensor answers again"));
  CHECK(watch.core.orders().look_up);

  for (int k = 0; k < 10; ++k) {
    watch.core.TakeCameraResult(k % 2 == 0 ? CameraResult::kLost : CameraResult::kWaiting,
                                "/dev/video0: unplugged", watch.now_s += 0.1);
  }
  CHECK(watch.core.Status().camera_lost);
  watch.core.TakeCameraResult(CameraResult::kFrame, "", watch.now_s += 1);
  CHECK_FALSE(watch.core.Status().camera_lost);
  CHECK(watch.Says("camera back after 1.9 s"));
}

TEST_CASE("a lens that is found after the camera came late is taken up") {
  Watch watch;
  watch.Stand();
  for (int k = 0; k < 60; ++k) watch.Reading();  // longer than the patience for an answer
  CHECK(watch.core.state() == ZoomState::kStale);
  CHECK(watch.core.orders().look_up);
  watch.Load(Watch::LensOf(watch.real, 7));
  watch.Look();
  CHECK(watch.core.state() == ZoomState::kValid);
}
