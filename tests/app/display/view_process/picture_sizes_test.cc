// The display's pictures with the real font and renderer, in every state and size. With
// PLUMBLINE_KEEP_PICTURES they are stored in that folder.
#include <algorithm>
#include <catch2/catch.hpp>
#include <ctime>

#include "app/display/view/cell_view.h"
#include "app/display/view/label_placement.h"
#include "app/display/view/screen_text.h"
#include "app/display/view_process/drawing.h"
#include "app/display/view_process/png_file.h"
#include "tests/app/cell/scene/shapes.h"
#include "tests/app/display/view/view_scene.h"

namespace plumbline::picture_sizes_test {

using namespace plumbline::test;
using cell::MeshOfObject;

namespace {

cell::MeshOfObject CuboidMesh(const Vec3f& sides) {
  auto checked = scene::CheckMesh(Cuboid(sides), 1);
  REQUIRE(checked);
  return std::make_shared<const scene::CheckedMesh>(std::move(checked).value());
}

/// A cell with a gripper at a car body, seven points and a synthetic image.
struct Wall {
  ViewScene scene;
  std::shared_ptr<cell::SceneSnapshot> objects = std::make_shared<cell::SceneSnapshot>();
  cell::SceneMeasurements measured;
  std::vector<std::uint8_t> image = std::vector<std::uint8_t>(std::size_t{1920} * 1080);

  explicit Wall(const std::string& overlay =
                    "exaggeration = 10.0\nstress = true\n"
                    "stress_full_MPa = 20.0\n")
      : scene(overlay) {
    for (std::size_t k = 0; k < image.size(); ++k) {
      const std::size_t u = k % 1920, v = k / 1920;
      image[k] = static_cast<std::uint8_t>(70 + 50 * ((u / 120 + v / 120) % 2) + v / 40);
    }
    AddTable();
    MorePoints(7);
    scene.state.monitoring.recording = true;
    scene.state.monitoring.drift_statistic = 0.31;
    scene.state.lines.push_back({3, 1.8e9 - 5, 4, "camera: 12 corners lost"});
    scene.state.lines.push_back({4, 1.8e9 - 2, 4, "camera: 17 corners lost"});
    measured.time_s = ViewScene::kNow_s;
  }

  void AddTable() {
    cell::ObjectTable table;
    cell::SceneObject gripper, body;
    gripper.name = "gripper";
    gripper.on.kind = cell::Carrier::Kind::kFlange;
    gripper.bends = true;
    gripper.X_KO.p = Vec3(0, 0, 0.35);
    body.name = "car body";
    body.on.kind = cell::Carrier::Kind::kWorld;
    body.X_KO.p = Tip_W() + Vec3(0.35, 0.3, -0.25);
    body.colour.a = 0.8F;
    table.objects = {gripper, body};
    table.pairs.push_back({0, 1, 0.05, 0.01});
    cell::SceneDistance distance;
    distance.name = "left gap";
    table.distances.push_back(distance);
    objects->table = table;
    objects->meshes = {CuboidMesh({0.12F, 0.12F, 0.7F}), CuboidMesh({0.5F, 0.2F, 0.3F})};
  }
  Vec3 Tip_W() const {
    deflection::LoadedState loaded;
    REQUIRE(scene.model->arm.AtCommanded(
        scene.state.q, {*scene.state.payload_kg, scene.state.payload_cog_F}, {}, loaded));
    return loaded.X_WT.p;
  }
  /// Points around the tip, the third without a correction.
  void MorePoints(int count) {
    auto& points = scene.model->config.machine.points;
    const correction::AssemblyPoint first = points.front();
    const cell::ViewPoint output = scene.state.points.front();
    points.clear();
    scene.state.points.clear();
    for (int k = 0; k < count; ++k) {
      points.push_back(first);
      points.back().id = k + 1;
      points.back().name = "assembly " + std::to_string(k + 1);
      points.back().X_WP.p = Tip_W() + Vec3(0.11 * (k % 4) - 0.12, 0.05 * k, 0.1 * (k / 4) - 0.02);
      scene.state.points.push_back(output);
      scene.state.points.back().id = k + 1;
      scene.state.points.back().uncertainty_m = 0.0012;
      scene.state.points.back().basis = model::RadiusBasis::kAssumed;
    }
    if (count > 2) {
      scene.state.points[2].valid = false;
      scene.state.points[2].code = correction::CorrectionCode::kUnreachable;
    }
  }
  void Interfere() {
    cell::MeasuredPair pair{"gripper",         "car body", 1, 2, scene::Proximity::kInterference,
                            cell::Separation{}};
    pair.separation->touching = true;
    pair.separation->depth_m = 0.0202;
    pair.separation->p_a_W = pair.separation->p_b_W = Tip_W() + Vec3(0.1, 0.2, -0.1);
    measured.pairs = {pair};
    scene.state.health = HealthOf({.warnings = warning::kInterference});
    cell::MeasuredDistance gap{"left gap", 0.1231, Tip_W(), Tip_W() + Vec3(0.3, 0.2, 0.1)};
    measured.distances = {gap};
  }
  /// The board is captured, and is where it is wanted or not. A corner of the image is unknown.
  void Calibrate(bool met) {
    cell::ViewCamera& camera = scene.state.cameras[0];
    camera.status.state = lens::ZoomState::kCalibrating;
    camera.status.reason = lens::ZoomReason::kBoardStarted;
    camera.status.prompt = met ? lens::BoardPrompt::kHoldStill : lens::BoardPrompt::kUpperRight;
    camera.lens.reset();
    lens::BoardGuidance& guidance = camera.guidance.emplace();
    const auto outline = [](const std::array<lens::Vec2, 4>& corners) {
      std::vector<lens::Vec2> closed;
      for (std::size_t edge = 0; edge < 4; ++edge) {
        for (int part = 0; part < 4; ++part)
          closed.emplace_back(corners[edge] +
                              0.25 * part * (corners[(edge + 1) % 4] - corners[edge]));
      }
      closed.push_back(closed.front());
      return closed;
    };
    guidance.wanted_px = outline({lens::Vec2(1100, 90), {1850, 30}, {1850, 560}, {1100, 500}});
    guidance.seen_px = met ? outline({lens::Vec2(1110, 100), {1840, 50}, {1835, 570}, {1105, 505}})
                           : outline({lens::Vec2(620, 330), {1180, 300}, {1190, 690}, {630, 680}});
    guidance.met = met;
    guidance.views = 4;
    guidance.expected_views = 9;
    guidance.columns = 13;
    guidance.rows = 9;
    for (int k = 0; k < 13 * 9; ++k) {
      const auto right = static_cast<float>(k % 13), up = 8 - static_cast<float>(k / 13);
      guidance.uncertainty.push_back(0.02F * right * right + 0.03F * up * up);
    }
    scene.state.alarms = 0;
    scene.state.health = HealthOf({.warnings = warning::kLensStale});
  }
  void SecondCamera() {
    scene.state.cameras.push_back(scene.state.cameras[0]);
    scene.state.cameras[0].status.name = status::CameraName::kSide;
    scene.state.cameras[1].status.name = status::CameraName::kRear;
    scene.state.cameras[1].status.state = lens::ZoomState::kStale;
    scene.state.cameras[1].status.reason = lens::ZoomReason::kZoomChanged;
  }
};

/// One picture of the wall, drawn.
struct WallPicture {
  std::vector<cell::Carriers> carriers;
  display::ViewFacts facts;
  scene::DisplayList list;

  WallPicture(Wall& wall, display::Drawing& drawing, image::ImageSize size) {
    facts.shown.clear();
    if (wall.scene.state.cameras.empty()) {
      display::Viewpoint viewpoint;
      carriers.push_back(display::SeenFrom(viewpoint.Update(wall.scene.state, *wall.scene.model),
                                           wall.scene.Placed(), *wall.scene.model));
      facts.shown = {0};
    }
    for (std::size_t k = 0; k < wall.scene.state.cameras.size(); ++k) {
      cell::CarrierTracker memory;
      carriers.push_back(memory.Update(wall.scene.state, k, &*wall.scene.model, ViewScene::kNow_s));
      facts.shown.push_back(k);
    }
    facts.state = &wall.scene.state;
    facts.carriers = carriers;
    facts.model = &*wall.scene.model;
    facts.table = &*wall.objects->table;
    facts.measured = &wall.measured;
    facts.now_s = ViewScene::kNow_s;
    facts.frames_per_s = {30, 30};
    std::vector<const scene::MeshFacts*> mesh_facts;
    mesh_facts.reserve(wall.objects->meshes.size());
    for (const cell::MeshOfObject& mesh : wall.objects->meshes) mesh_facts.push_back(&mesh->facts);
    list = display::PictureOf({facts,
                               wall.scene.model->config.overlay,
                               drawing.Meshes(wall.objects),
                               {wall.image.data(), wall.image.data()},
                               mesh_facts},
                              display::LayoutFor(facts, size), drawing.text_width());
  }
};

/// Area that a text covers, from the ascent of its capitals to its descent.
scene::Area AreaOf(const scene::DrawnText& text, const display::TextWidth& width_of) {
  return {text.x, text.y - 0.8F * text.height_px, width_of(text.text, text.height_px),
          1.03F * text.height_px};
}

void ExpectTidyTexts(const scene::DisplayList& list, const display::TextWidth& width_of) {
  for (std::size_t a = 0; a < list.texts.size(); ++a) {
    const scene::Area first = AreaOf(list.texts[a], width_of);
    CAPTURE(list.texts[a].text);
    CHECK(first.x >= 0);
    CHECK(first.right() <= static_cast<float>(list.size.width));
    CHECK(first.y >= 0);
    CHECK(first.bottom() <= static_cast<float>(list.size.height));
    CHECK(list.texts[a].height_px >= 9);
    for (std::size_t b = a + 1; b < list.texts.size(); ++b) {
      CAPTURE(list.texts[b].text);
      CHECK(display::OverlapOf(first, AreaOf(list.texts[b], width_of)) == 0);
    }
  }
}

void Keep(display::Drawing& drawing, const std::string& name) {
  const char* const folder = std::getenv("PLUMBLINE_KEEP_PICTURES");
  if (folder == nullptr) return;
  REQUIRE(
      display::WritePng(std::string(folder) + "/" + name + ".png", drawing.renderer().ReadBack()));
}

constexpr image::ImageSize kSizes[] = {{640, 480},   {1024, 768},  {1280, 720},
                                       {1600, 1200}, {1920, 1080}, {3840, 2160}};

}  // namespace

TEST_CASE("no text overlaps another or leaves the picture, with the real font at every size") {
  display::Drawing drawing([](const plumbline::log::LogEntry&) {});
  if (!drawing.Ready(0)) {
    std::puts("SKIPPED: no EGL here");
    return;
  }
  const std::string state = GENERATE("good", "note", "interference", "stale", "silent", "two",
                                     "drawn", "drawn-stale", "guided", "met", "guided-two");
  Wall wall(state == "good" ? "" : "exaggeration = 10.0\nstress = true\nstress_full_MPa = 20.0\n");
  if (state == "good") wall.MorePoints(2);
  if (state == "good") {
    for (cell::ViewPoint& point : wall.scene.state.points)
      point.basis = model::RadiusBasis::kMeasured;
  }
  if (state == "note")
    wall.scene.state.health = HealthOf({.weakest_basis = model::RadiusBasis::kAssumed});
  if (state == "interference" || state == "two") wall.Interfere();
  if (state == "two") wall.SecondCamera();
  if (state == "stale") {
    wall.scene.state.cameras[0].status.state = lens::ZoomState::kCalibrating;
    wall.scene.state.cameras[0].status.prompt = lens::BoardPrompt::kTiltLeft;
  }
  if (state == "guided-two") wall.SecondCamera();
  if (state.starts_with("guided") || state == "met") wall.Calibrate(state == "met");
  if (state.starts_with("drawn")) {
    wall.scene.state.cameras.clear();
    wall.objects = std::make_shared<cell::SceneSnapshot>();
    wall.objects->table.emplace();
    if (state == "drawn-stale") {  // with a mesh of the forearm
      cell::SceneObject forearm;
      forearm.on = {cell::Carrier::Kind::kLink, "", 0, 3};
      wall.objects->table->objects = {forearm};
      wall.objects->meshes = {CuboidMesh({0.3F, 0.3F, 0.3F})};
    }
  }
  if (state == "drawn-stale") wall.scene.state.alarms = alarm::kRobotStale;
  if (state == "silent") wall.scene.state.now_s -= 10;
  for (const image::ImageSize size : kSizes) {
    CAPTURE(state, size.width, size.height);
    const WallPicture picture(wall, drawing, size);
    ExpectTidyTexts(picture.list, drawing.text_width());
    REQUIRE(drawing.Draw(picture.list));
    Keep(drawing, "wall-" + state + "-" + std::to_string(size.width));
  }
}

TEST_CASE("drawing time against a plain undistorted image", "[.bench]") {
  display::Drawing drawing([](const plumbline::log::LogEntry&) {});
  REQUIRE(drawing.Ready(0));
  Wall wall;
  wall.Interfere();
  scene::DisplayList plain;
  plain.size = {1920, 1080};
  plain.background.luma = {wall.image.data(), 1920, 1080, 1920};
  plain.background.lens = *wall.scene.state.cameras[0].lens;
  plain.pinhole = display::PinholeIn({0, 0, 1920, 1080}, *plain.background.lens, {1920, 1080});
  const auto now_ms = [] {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
  };
  std::vector<double> plain_ms, wall_ms, composing_ms;
  for (std::uint64_t k = 1; k <= 60; ++k) {
    double start = now_ms();
    plain.background.sequence = 2 * k;
    REQUIRE(drawing.Draw(plain));
    drawing.renderer().ReadBack();
    plain_ms.push_back(now_ms() - start);
    start = now_ms();
    wall.scene.state.cameras[0].image->time_s += 1e-6;  // another image
    WallPicture picture(wall, drawing, {1920, 1080});
    composing_ms.push_back(now_ms() - start);
    REQUIRE(drawing.Draw(picture.list));
    drawing.renderer().ReadBack();
    wall_ms.push_back(now_ms() - start);
  }
  const auto median = [](std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
  };
  std::printf(
      "1920x1080, CPU time, medians of 60: plain undistorted image %.1f ms; the display's "
      "picture %.1f ms, of that layout %.1f ms; ratio %.2f (goal <= 1.1)\n",
      median(plain_ms), median(wall_ms), median(composing_ms), median(wall_ms) / median(plain_ms));
}

}  // namespace plumbline::picture_sizes_test
