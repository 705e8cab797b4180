#include "app/vision/camera/lens_supervisor.h"

#include <catch2/catch.hpp>

#include "app/vision/camera/camera_supervisor.h"
#include "tests/app/temporary_folder.h"
#include "tests/app/vision/camera/reference_tag_scene.h"

namespace plumbline::lens_supervisor_test {

using namespace plumbline::vision;
using namespace plumbline::test;

namespace {

/// A LensSupervisor with a simulated clock, cell and gripper.
struct Rig {
  std::vector<std::string> log;
  target::Body cell = CellTags();
  target::Body gripper{"gripper",
                       {{20, 0.06, {Mat3::Identity(), Vec3(-0.1, 0, 0)}},
                        {21, 0.06, {Mat3::Identity(), Vec3(0.1, 0.05, 0.01)}}}};
  Pose X_CK = CellInCamera();
  Pose X_CT{Mat3::Identity(), Vec3(0.05, 0.02, 1.45)};
  lens::Lens real = TagSceneLens();
  double now_s = 100;
  std::int32_t zoom = 4000;
  std::uint64_t image_number = 0;
  LensSupervisor supervisor;

  Rig()
      : supervisor(Settings(), [this](const log::LogEntry& entry) { log.push_back(entry.text); }) {}

  LensSupervisorSettings Settings() const {
    LensSupervisorSettings settings;
    settings.cell = cell;
    settings.bodies = {"cell", "gripper"};
    settings.tool = "gripper";
    settings.tip_T = Vec3(0.2, 0, 0);
    settings.X_WK.p = Vec3(1, 2, 3);
    return settings;
  }
  void Reading(double after_s = 0.1) {
    now_s += after_s;
    lens::ZoomReading reading;
    reading.zoom_counts = zoom;
    reading.time_s = now_s;
    supervisor.OnZoomReading(reading, now_s);
  }
  void Stand() {
    for (int k = 0; k < 6; ++k) Reading();
  }
  static std::shared_ptr<ActiveLens> LensOf(const lens::Lens& lens, std::int64_t id) {
    auto in_use = std::make_shared<ActiveLens>();
    in_use->known.lens = lens;
    in_use->known.covariance.diagonal().head<9>() << 0.25, 0.25, 1, 1, 1e-8, 1e-8, 1e-12, 1e-12, 0;
    in_use->known.size = {1920, 1080};
    in_use->calibrated = true;
    in_use->id = id;
    return in_use;
  }
  void Load(std::shared_ptr<const ActiveLens> lens) {
    const FrameContext context = supervisor.frame_context();
    REQUIRE(context.needs_lens);
    supervisor.OnLensLookup(std::move(lens), nullptr, context, now_s, now_s + 0.01);
    now_s += 0.02;
  }
  /// Processes one image: tag check and bodies. @param hidden  the reference tags are
  bool Image(bool hidden = false) {
    Reading(0.05);
    const FrameContext context = supervisor.frame_context();
    if (!context.lens) return false;
    std::vector<vision::SeenTag> seen;
    if (!hidden) seen = ObserveTags(real, cell, X_CK, 0.05, 2 * ++image_number);
    for (const vision::SeenTag& tag :
         ObserveTags(real, gripper, X_CT, 0.05, 2 * image_number + 1)) {
      seen.push_back(tag);
    }
    const TagCheck check =
        CheckReferenceTags(*context.lens, context.baseline.get(), cell, seen, 0.5);
    const bool changed = supervisor.OnTagCheck(check, context, now_s - 0.01, now_s);
    std::vector<vision::SeenBody> bodies;
    for (const target::Body* body : {&cell, &gripper}) {
      if (auto located = vision::LocateBody(context.lens->known, *body, seen, std::nullopt)) {
        bodies.push_back(*located);
      }
    }
    supervisor.OnBodies(bodies, context, now_s - 0.01);
    return changed;
  }
  void Valid() {
    Stand();
    Load(LensOf(real, 7));
    Image();
    REQUIRE(supervisor.state() == lens::ZoomState::kValid);
    for (int k = 0; k < 4; ++k) Image();
  }
  bool Says(const std::string& text) const {
    return std::any_of(log.begin(), log.end(), [&](const std::string& line) {
      return line.find(text) != std::string::npos;
    });
  }
};

}  // namespace

TEST_CASE("from the first sensor reading to bodies and tip in the measurement frame") {
  Rig rig;
  CHECK(rig.supervisor.Status().configured);
  CHECK(rig.supervisor.Status().lens_stale);
  CHECK(rig.supervisor.Status().camera_lost);
  rig.supervisor.OnCameraResult(camera::CameraResult::kFrame, "", rig.now_s);
  rig.Valid();
  const status::CameraStatus status = rig.supervisor.Status();
  CHECK_FALSE(status.lens_stale);
  CHECK_FALSE(status.camera_lost);
  CHECK_FALSE(status.zoom_unknown);
  CHECK_FALSE(status.board_wanted);
  CHECK(status.lens_id == 7);
  CHECK(status.zoom_counts == 4000);
  REQUIRE(status.bodies[1].valid);
  const Vec3 truth = Vec3(1, 2, 3) + rig.X_CK.Inverse() * (rig.X_CT * Vec3(0, 0, 0));
  CHECK((status.bodies[1].X_WK.p - truth).norm() < 2 * status.bodies[1].radius_m);
  REQUIRE(status.tip_valid);
  const Vec3 tip = Vec3(1, 2, 3) + rig.X_CK.Inverse() * (rig.X_CT * Vec3(0.2, 0, 0));
  CHECK((status.tip_W - tip).norm() < 5e-3);
  CHECK(rig.Says("camera valid: the reference tags are where they should be (zoom 4000)"));
}

TEST_CASE("a changed zoom reading invalidates everything; a known lens restores it") {
  Rig rig;
  rig.supervisor.OnCameraResult(camera::CameraResult::kFrame, "", rig.now_s);
  rig.Valid();
  rig.zoom = 5000;
  rig.Reading();
  status::CameraStatus status = rig.supervisor.Status();
  CHECK(status.state == lens::ZoomState::kMoving);
  CHECK(rig.supervisor.Status().lens_stale);
  CHECK_FALSE(status.tip_valid);
  CHECK_FALSE(status.bodies[0].valid);
  CHECK(status.lens_id == 0);
  CHECK_FALSE(rig.supervisor.frame_context().lens);
  rig.Stand();
  rig.real.fx *= 1.2;
  rig.real.fy *= 1.2;
  rig.Load(Rig::LensOf(rig.real, 8));
  rig.Image();
  CHECK(rig.supervisor.Status().state == lens::ZoomState::kValid);
  CHECK(rig.supervisor.Status().lens_id == 8);
}

TEST_CASE("results from before a zoom motion are ignored") {
  Rig rig;
  rig.Stand();
  const FrameContext context = rig.supervisor.frame_context();
  const double lookup_time_s = rig.now_s;
  rig.zoom = 5000;
  rig.Stand();
  rig.supervisor.OnLensLookup(Rig::LensOf(rig.real, 7), nullptr, context, lookup_time_s, rig.now_s);
  CHECK_FALSE(rig.supervisor.frame_context().lens);
  CHECK(rig.supervisor.frame_context().needs_lens);
  rig.Load(Rig::LensOf(rig.real, 8));
  const FrameContext of_eight = rig.supervisor.frame_context();
  TagCheck good;
  good.verdict = TagTestOutcome::kGood;
  rig.supervisor.OnTagCheck(good, of_eight, lookup_time_s, rig.now_s);  // an image from before
  CHECK(rig.supervisor.state() == lens::ZoomState::kVerifying);
  rig.supervisor.OnTagCheck(good, context, rig.now_s, rig.now_s);  // with another lens
  CHECK(rig.supervisor.state() == lens::ZoomState::kVerifying);
  rig.supervisor.OnTagCheck(good, of_eight, rig.now_s, rig.now_s);
  CHECK(rig.supervisor.state() == lens::ZoomState::kValid);
}

TEST_CASE(
    "zoom without a lens: the board is requested, captured and accepted, refused or cancelled") {
  Rig rig;
  rig.supervisor.OnCameraResult(camera::CameraResult::kFrame, "", rig.now_s);
  rig.Stand();
  rig.Load(nullptr);
  CHECK(rig.supervisor.state() == lens::ZoomState::kStale);
  CHECK(rig.supervisor.frame_context().search_for_board);
  CHECK_FALSE(rig.supervisor.frame_context().needs_lens);
  CHECK(rig.supervisor.Status().prompt == lens::BoardPrompt::kShowBoard);
  CHECK(rig.supervisor.Status().board_wanted);
  REQUIRE(rig.supervisor.StartBoard(rig.now_s));
  const double began_s = rig.now_s;
  lens::BoardGuidance guidance;
  guidance.views = 1;
  guidance.expected_views = 6;
  guidance.uncertainty = {0.5F, 3};
  rig.supervisor.OnBoardProgress(lens::BoardPrompt::kTiltLeft, guidance, rig.now_s += 0.5);
  CHECK(
      rig.Says("camera: 1 view of the board, about 6 expected, 50 % of the image certain; tilt "
               "the left edge towards the camera"));
  CHECK(rig.supervisor.Status().prompt == lens::BoardPrompt::kTiltLeft);
  CHECK(rig.supervisor.Status().board_views == 1);
  rig.Reading();
  SECTION("accepted") {
    REQUIRE(rig.supervisor.OnBoardAccepted(*Rig::LensOf(rig.real, 0), began_s, rig.now_s));
    rig.supervisor.SetStoredId(9);
    CHECK(rig.supervisor.Status().lens_id == 9);
    CHECK(rig.Image());  // a baseline is set for the new lens
    CHECK_FALSE(rig.Image());
    CHECK(rig.supervisor.state() == lens::ZoomState::kValid);
    CHECK(rig.supervisor.Status().board_views == 0);
  }
  SECTION("refused with reasons; the board is still requested") {
    rig.supervisor.OnBoardRefused({"the board is not what it should be"}, rig.now_s);
    CHECK(rig.supervisor.state() == lens::ZoomState::kRefused);
    CHECK(rig.supervisor.frame_context().search_for_board);
    CHECK(rig.Says("calibration refused: the board is not what it should be"));
  }
  SECTION("cancelled") {
    rig.supervisor.CancelBoard(rig.now_s);
    CHECK(rig.supervisor.state() == lens::ZoomState::kStale);
  }
  SECTION("the zoom moved during the capture: the result is not used") {
    rig.zoom = 100;
    rig.Reading();
    CHECK(rig.supervisor.state() == lens::ZoomState::kMoving);
    CHECK_FALSE(rig.supervisor.OnBoardAccepted(*Rig::LensOf(rig.real, 0), began_s, rig.now_s));
    CHECK_FALSE(rig.supervisor.StartBoard(rig.now_s));
    CHECK(rig.Says("calibration cannot start now: the zoom changed"));
  }
}

TEST_CASE("a valid lens remains in use if a new calibration is refused") {
  Rig rig;
  rig.supervisor.OnCameraResult(camera::CameraResult::kFrame, "", rig.now_s);
  rig.Valid();
  REQUIRE(rig.supervisor.StartBoard(rig.now_s));
  CHECK(rig.supervisor.Status().lens_stale);
  rig.Reading();
  rig.supervisor.OnBoardRefused({"blurred"}, rig.now_s);
  CHECK(rig.supervisor.frame_context().lens->id == 7);
  rig.Image();
  CHECK(rig.supervisor.state() == lens::ZoomState::kValid);
}

TEST_CASE(
    "reference tags: hidden tags change nothing, a drift is refined, a bad lens becomes stale") {
  Rig rig;
  rig.supervisor.OnCameraResult(camera::CameraResult::kFrame, "", rig.now_s);
  rig.Valid();
  const lens::Lens before = rig.real;
  SECTION("hidden") {
    for (int k = 0; k < 10; ++k) rig.Image(true);
    CHECK(rig.supervisor.state() == lens::ZoomState::kValid);
    CHECK_FALSE(rig.supervisor.Status().tip_valid);  // the cell is not visible
  }
  SECTION("drift") {
    rig.real.fx *= 1.002;
    rig.real.fy *= 1.002;
    CHECK_FALSE(rig.Image());
    CHECK_FALSE(rig.supervisor.Status().tip_valid);  // in doubt, so nothing is measured
    CHECK_FALSE(rig.Image());
    CHECK(rig.Image());
    CHECK(rig.supervisor.state() == lens::ZoomState::kValid);
    CHECK(rig.supervisor.frame_context().lens->known.lens.fx ==
          Approx(1.002 * before.fx).epsilon(3e-4));
    CHECK(rig.Says("the zoom drifted"));
    for (int k = 0; k < 3; ++k) rig.Image();
    CHECK(rig.supervisor.Status().tip_valid);
  }
  SECTION("the camera is pushed") {
    rig.X_CK.p.x() += 0.01;
    rig.X_CT.p.x() += 0.01;
    for (int k = 0; k < 8; ++k) rig.Image();
    CHECK(rig.supervisor.state() == lens::ZoomState::kValid);
    CHECK(rig.Says("the camera was moved by"));
    CHECK(rig.supervisor.frame_context().lens->known.lens.fx == before.fx);
    CHECK(rig.supervisor.Status().tip_valid);
  }
  SECTION("neither drift nor motion") {
    rig.real.k1 += 0.2;
    rig.real.cx += 30;
    for (int k = 0; k < 2; ++k) rig.Image();
    CHECK(rig.supervisor.state() == lens::ZoomState::kValid);
    rig.Image();
    CHECK(rig.supervisor.state() == lens::ZoomState::kStale);
    CHECK(rig.supervisor.Status().board_wanted);
    CHECK(rig.Says("neither a drift"));
    const std::size_t lines = rig.log.size();
    for (int k = 0; k < 20; ++k) rig.Image();
    CHECK(rig.log.size() == lines);  // logged once
    rig.real = before;
    for (int k = 0; k < 3; ++k) rig.Image();
    CHECK(rig.supervisor.state() == lens::ZoomState::kValid);
  }
}

TEST_CASE(
    "digital zoom: refused with the reason, no capture starts, the lens is looked up again "
    "afterwards") {
  Rig rig;
  rig.supervisor.OnCameraResult(camera::CameraResult::kFrame, "", rig.now_s);
  rig.Valid();
  const auto read = [&](bool digital) {
    lens::ZoomReading reading;
    reading.zoom_counts = rig.zoom;
    reading.digital_zoom = digital;
    rig.now_s += 0.1;
    reading.time_s = rig.now_s;
    rig.supervisor.OnZoomReading(reading, rig.now_s);
  };
  read(true);
  CHECK(rig.supervisor.state() == lens::ZoomState::kRefused);
  CHECK(rig.supervisor.Status().lens_stale);
  CHECK_FALSE(rig.supervisor.Status().tip_valid);
  CHECK(rig.Says("camera refused: " +
                 std::string(lens::ZoomReasonText(lens::ZoomReason::kDigitalZoom))));
  CHECK_FALSE(rig.supervisor.StartBoard(rig.now_s));
  CHECK(rig.Says("calibration cannot start now"));
  const std::size_t lines = rig.log.size();
  for (int k = 0; k < 10; ++k) read(true);
  CHECK(rig.log.size() == lines);  // logged once
  for (int k = 0; k < 8; ++k) read(false);
  CHECK(rig.supervisor.frame_context().needs_lens);
}

TEST_CASE("invalid sensor replies: zoom unknown, with the driver's message") {
  for (const auto& [result, message] :
       {std::pair{zoom::ZoomResult::kProtocol, "an answer of 2 bytes is too short"},
        {zoom::ZoomResult::kTimeout,
         "camera 1 does not answer, but camera 3 does. Check camera.zoom.address."},
        {zoom::ZoomResult::kRefused, "reports an error: not executable (41)"}}) {
    Rig rig;
    rig.supervisor.OnCameraResult(camera::CameraResult::kFrame, "", rig.now_s);
    rig.Valid();
    for (int k = 0; k < 30; ++k) rig.supervisor.OnSensorFault(result, message, rig.now_s += 0.1);
    CHECK(rig.supervisor.state() == lens::ZoomState::kUnknown);
    CHECK(rig.supervisor.Status().zoom_unknown);
    CHECK_FALSE(rig.supervisor.Status().tip_valid);
    CHECK(rig.Says(message));
  }
}

TEST_CASE("sensor and camera lost and restored: logged once each") {
  Rig rig;
  rig.supervisor.OnCameraResult(camera::CameraResult::kFrame, "", rig.now_s);
  rig.Valid();
  for (int k = 0; k < 30; ++k) {
    rig.supervisor.OnSensorFault(
        k % 2 == 0 ? zoom::ZoomResult::kTimeout : zoom::ZoomResult::kWaiting,
        "no answer of camera 1; cable?", rig.now_s += 0.1);
  }
  CHECK(rig.supervisor.state() == lens::ZoomState::kUnknown);
  CHECK(rig.supervisor.Status().zoom_unknown);
  CHECK(std::count_if(rig.log.begin(), rig.log.end(), [](const std::string& line) {
          return line.find("cable?") != std::string::npos;
        }) == 1);
  rig.Stand();
  CHECK(rig.Says("zoom sensor responds again"));
  CHECK(rig.supervisor.frame_context().needs_lens);

  for (int k = 0; k < 10; ++k) {
    rig.supervisor.OnCameraResult(
        k % 2 == 0 ? camera::CameraResult::kLost : camera::CameraResult::kWaiting,
        "/dev/video0: unplugged", rig.now_s += 0.1);
  }
  CHECK(rig.supervisor.Status().camera_lost);
  rig.supervisor.OnCameraResult(camera::CameraResult::kFrame, "", rig.now_s += 1);
  CHECK_FALSE(rig.supervisor.Status().camera_lost);
  CHECK(rig.Says("camera back after 1.9 s"));
}

TEST_CASE("a lens found late, after the verification timed out, is still used") {
  Rig rig;
  rig.Stand();
  for (int k = 0; k < 60; ++k) rig.Reading();  // longer than the verification timeout
  CHECK(rig.supervisor.state() == lens::ZoomState::kStale);
  CHECK(rig.supervisor.frame_context().needs_lens);
  rig.Load(Rig::LensOf(rig.real, 7));
  rig.Image();
  CHECK(rig.supervisor.state() == lens::ZoomState::kValid);
}

TEST_CASE("the calibration relies on what is declared of its camera") {
  const BoardSettings settings = BoardSettingsFrom({}, {.no_window = true, .fixed_focus = false});
  CHECK(settings.options.declared == target::DeclaredFacts{true, false});
}

TEST_CASE("a stored lens is not used after its declaration was withdrawn; the log says so") {
  const TemporaryFolder folder;
  {
    auto store = vision::LensStore::Open(folder.path() + "/lenses.sqlite");
    vision::LensEntry entry;
    entry.key = {"camera", "mode", 100, std::nullopt};
    entry.lens.fx = entry.lens.fy = 1000;
    entry.covariance(0, 0) = 1;
    entry.size = {1920, 1080};
    entry.utc = "2026-01-01T00:00:00Z";
    entry.declared = {.no_window = true, .fixed_focus = true};
    REQUIRE(store.value().Append(entry));
  }
  std::vector<std::string> log;
  const auto sink = [&log](const log::LogEntry& entry) { log.push_back(entry.text); };
  CameraStores stores(folder.path(), {}, sink);
  const camera::CameraIdentity camera{"camera", "mode"};
  FrameContext context;
  context.zoom_counts = 100;
  CameraLenses same(stores, {}, {.no_window = true, .fixed_focus = true}, sink);
  const auto found = same.Find(camera, context);
  REQUIRE((found && found->lens));
  CHECK(found->lens->id == 1);
  CHECK(log.empty());
  CameraLenses less(stores, {}, {.no_window = true, .fixed_focus = false}, sink);
  const auto none = less.Find(camera, context);
  REQUIRE(none);
  CHECK(none->lens == nullptr);
  REQUIRE(log.size() == 1);
  CHECK_THAT(log[0], Catch::Contains("lens 1 of this zoom is not used") &&
                         Catch::Contains("under the declaration fixed_focus, which"));
}

}  // namespace plumbline::lens_supervisor_test
