#include "app/display/view/point_tiles.h"

#include <catch2/catch.hpp>

#include "app/display/view/tip_inset.h"
#include "tests/app/display/view/view_scene.h"

namespace plumbline::point_tiles_test {

using namespace plumbline::display;
using test::ViewScene;

namespace {

std::vector<PointTile> TilesIn(ViewScene& scene) {
  ViewFacts facts;
  facts.state = &scene.state;
  facts.model = &*scene.model;
  return TilesOf(facts);
}

float WidthOfText(const std::string& text, float em) {
  return 0.6F * em * static_cast<float>(text.size());
}

/// Texts of the tiles at a time.
std::string PageAt(ViewScene& scene, double utc_s) {
  scene.state.utc_s = utc_s;
  ViewFacts facts;
  facts.state = &scene.state;
  facts.model = &*scene.model;
  const PictureLayout layout = LayoutOf({1920, 1080});
  scene::DisplayList list;
  PictureWriter writer(layout, WidthOfText, list);
  AddPointTiles(facts, writer);
  std::string all;
  for (const scene::DrawnText& text : list.texts) all += text.text + "\n";
  return all;
}

}  // namespace

TEST_CASE("a tile states correction, radius with its basis, and drift") {
  ViewScene scene;
  scene.state.points[0].basis = model::RadiusBasis::kAssumed;
  scene.state.monitoring.recording = true;
  scene.state.monitoring.drift_statistic = 0.256;
  const PointTile tile = TilesIn(scene).front();
  CHECK(tile.name == "assembly 1");
  CHECK(tile.value == "4.15 mm");
  CHECK(tile.radius == "±0.30 mm (95 %, assumed)");
  CHECK(tile.note == "drift 0.26 of threshold");
  scene.state.points[0].basis = model::RadiusBasis::kUnknown;
  CHECK(TilesIn(scene).front().radius == "±0.30 mm (basis unknown)");
  CHECK(tile.state == StateClass::kAdvisory);
  scene.state.monitoring.drift_statistic = 0;
  CHECK(TilesIn(scene).front().note == "drift: no probes yet");
  scene.state.monitoring.learning = true;
  scene.state.monitoring.reference_learned = 7;
  scene.state.monitoring.reference_wanted = 20;
  CHECK(TilesIn(scene).front().note == "learning the reference: 7 of 20 probes");
}

TEST_CASE("a tile states why a point is not valid, and what limits the use of a valid one") {
  ViewScene scene;
  REQUIRE(scene.state.points.size() >= 2);
  scene.state.points[0].valid = false;
  scene.state.points[0].code = correction::CorrectionCode::kUnreachable;
  scene.state.points[1].extrapolated = true;
  std::vector<PointTile> tiles = TilesIn(scene);
  CHECK(tiles[0].value == "not valid");
  CHECK(tiles[0].radius == "out of reach (code 1)");
  CHECK(tiles[0].note == "check the point, its frame and the robot's base");
  CHECK(tiles[0].state == StateClass::kAlarm);
  CHECK(tiles[1].note == "outside calibrated range");
  CHECK(tiles[1].state == StateClass::kWarning);
  scene.state.points[1].extrapolated = false;
  scene.state.monitoring.drift_alarm = true;
  scene.state.monitoring.drift_statistic = 1.83;
  scene.state.warnings = warning::kDrift;
  tiles = TilesIn(scene);
  CHECK(tiles[1].note == "DRIFT: 1.8 × threshold");
  CHECK(tiles[1].state == StateClass::kWarning);
}

TEST_CASE("every point is shown within one turn of the pages") {
  ViewScene scene;
  const cell::ViewPoint point = scene.state.points.front();
  scene.state.points.assign(8, point);
  for (int k = 0; k < 8; ++k) scene.state.points[static_cast<std::size_t>(k)].id = 11 + k;
  scene.state.points[7].valid = false;
  std::string all;
  for (int turn = 0; turn < 3; ++turn) {
    const std::string page = PageAt(scene, 1.8e9 + turn * kTilePage_s);
    CHECK(page.find("of 8, 1 not valid") != std::string::npos);
    all += page;
  }
  for (int id = 11; id < 19; ++id) {
    CHECK(all.find("point " + std::to_string(id)) != std::string::npos);
  }
  scene.state.points.resize(2);
  CHECK(PageAt(scene, 1.8e9).find(" of ") == std::string::npos);
}

TEST_CASE("the inset shows the nearest valid point to scale") {
  ViewScene scene("exaggeration = 20.0\n");
  const cell::Carriers carriers = scene.Placed();
  ViewFacts facts;
  facts.state = &scene.state;
  facts.carriers = std::span(&carriers, 1);
  facts.model = &*scene.model;
  facts.now_s = ViewScene::kNow_s;
  const std::vector<int> meshes;
  const OverlayInput input{facts, scene.model->config.overlay, meshes, {}};
  const lens::Lens pinhole = PlainLens({1920, 1080});
  const auto inset = InsetOf(input, 0, pinhole);
  REQUIRE(inset);
  const Vec3 missed_C =
      -(scene.X_CW.R * scene.model->arm.X_WB().R * scene.state.points[0].translation_B);
  CHECK(inset->uncorrected_mm.x() == Approx(1e3 * missed_C.x()));
  CHECK(inset->uncorrected_mm.y() == Approx(1e3 * missed_C.y()));
  CHECK(inset->radius_mm == Approx(0.3));
  // A correction along the line of sight, y of W, is shown in a plane that contains it.
  const Mat3 R_BW = scene.model->arm.X_WB().R.transpose();
  for (cell::ViewPoint& point : scene.state.points)
    point.translation_B = R_BW * Vec3(0.0001, 0.004, 0.001);
  CHECK(InsetOf(input, 0, pinhole)->uncorrected_mm.norm() == Approx(std::hypot(4, 1)));
  // Without a camera, too.
  cell::Carriers unseen = carriers;
  unseen.world.reset();
  facts.carriers = std::span(&unseen, 1);
  REQUIRE(InsetOf(input, 0, pinhole));
  CHECK(InsetOf(input, 0, pinhole)->uncorrected_mm.norm() == Approx(std::hypot(4, 1)));
  CHECK(InsetOf(input, 0, pinhole)->image_px_per_mm == 0);
  for (cell::ViewPoint& point : scene.state.points) point.valid = false;
  CHECK_FALSE(InsetOf(input, 0, pinhole));
}

}  // namespace plumbline::point_tiles_test
