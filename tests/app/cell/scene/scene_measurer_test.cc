// SceneMeasurer with two cuboids, one on the flange and one in the cell.
#include <catch2/catch.hpp>

#include "app/cell/scene/scene_worker.h"
#include "tests/app/cell/scene/shapes.h"
#include "tests/app/display/view/view_scene.h"

namespace plumbline::scene_measurer_test {

using namespace plumbline::cell;
using namespace plumbline::test;

namespace {

MeshOfObject Box(float side) {
  auto checked = scene::CheckMesh(Cuboid({side, side, side}), 1);
  REQUIRE(checked);
  return std::make_shared<const scene::CheckedMesh>(std::move(checked).value());
}

struct MeasuredScene {
  ViewScene view;
  std::vector<std::string> logged;
  std::vector<log::Event> events;
  SceneMeasurer measurer{0, [this](const log::LogEntry& entry) {
                           logged.push_back(entry.text);
                           events.push_back(entry.event);
                         }};
  std::shared_ptr<SceneSnapshot> scene = std::make_shared<SceneSnapshot>();

  /// A cuboid of 0.2 m at the tool tip, and a wall of 0.2 m whose centre is `apart_m` further along
  /// y.
  void PlaceWall(double apart_m) {
    const Carriers carriers = view.Placed();
    REQUIRE(carriers.tool);
    scene = std::make_shared<SceneSnapshot>(*scene);
    ++scene->version;
    ObjectTable table;
    SceneObject box, wall;
    box.name = "box";
    box.number = 4;
    wall.number = 9;
    box.on.kind = Carrier::Kind::kFlange;
    const double length_m = static_cast<double>(carriers.tool->bend.length_m);
    box.bends = true;
    // Straight tool: aligned with W once it is bent.
    const scene::BendStation& tip = carriers.tool->bend.stations.back();
    const Mat3 R_WT = carriers.tool->X_WF.R * RotationFromVector(tip.r_F.cast<double>());
    box.X_KO = {R_WT.transpose(), Vec3(0, 0, length_m)};
    wall.name = "wall";
    wall.on.kind = Carrier::Kind::kWorld;
    wall.X_KO.p = carriers.tool->tip_W + Vec3(0, apart_m, 0);
    table.objects = {box, wall};
    table.pairs.push_back({0, 1, 0.05, 0.001});
    ScenePoint corner{"corner", std::size_t{1}, Vec3(0, -0.1, 0)};
    table.points.push_back(corner);
    table.distances.push_back({"gap", {true, 0}, {false, 0}});
    SceneLine path;
    path.name = "approach";
    path.on.kind = Carrier::Kind::kWorld;
    const Vec3 from = carriers.tool->tip_W;
    path.points_K = {from - Vec3(0, 0.5, 0), from + Vec3(0, 2, 0)};
    path.sweep = SceneSweep{0, {}, {1}};
    table.lines.push_back(path);
    scene->table = table;
    scene->meshes = {Box(0.2F), Box(0.2F)};
  }
  SceneMeasurements Measure() {
    measurer.SetScene(scene);
    return measurer.Measure({ViewScene::kNow_s, view.Placed()}, ViewScene::kNow_s);
  }
};

}  // namespace

TEST_CASE("distance, named distance and sweep between the bent tool's box and a wall") {
  MeasuredScene watched;
  watched.PlaceWall(0.5);
  SceneMeasurements measured = watched.Measure();
  const status::SceneStatus logged = SceneStatusOf(measured);
  CHECK(logged.interferences == 0);
  CHECK(logged.object_a == 4);
  CHECK(logged.object_b == 9);
  CHECK(logged.smallest_m == Approx(0.3).margin(5e-4));
  REQUIRE(measured.pairs.size() == 1);
  REQUIRE(measured.pairs[0].separation);
  // The box is bent with the tool: its sections turn by milliradians, its sides by micrometres.
  CHECK(measured.pairs[0].separation->distance_m == Approx(0.3).margin(5e-4));
  CHECK(measured.pairs[0].state == scene::Proximity::kApart);
  CHECK(watched.logged.empty());
  REQUIRE(measured.distances.size() == 1);
  REQUIRE(measured.distances[0].distance_m);
  CHECK(*measured.distances[0].distance_m == Approx(0.3).margin(5e-4));
  REQUIRE(measured.sweeps.size() == 1);
  REQUIRE(measured.sweeps[0].result);
  CHECK(measured.sweeps[0].result->hits);
  CHECK(measured.sweeps[0].other == "wall");
}

TEST_CASE("begin and end of nearness and interference are logged once each") {
  MeasuredScene watched;
  watched.PlaceWall(0.22);
  CHECK(watched.Measure().pairs[0].state == scene::Proximity::kNear);
  watched.Measure();
  REQUIRE(watched.logged.size() == 1);
  CHECK_THAT(watched.logged[0], Catch::Contains("box and wall are near: 2"));

  // Without the cell tags, objects on the flange and in W are still placed by the robot's joints.
  watched.view.state.cameras[0].bodies.clear();
  CHECK(watched.Measure().pairs[0].separation);
  // Without a trusted robot reading nothing is measured, and the state does not change.
  watched.view.state.alarms = alarm::kRobotStale;
  const SceneMeasurements unknown = watched.Measure();
  CHECK_FALSE(unknown.pairs[0].separation);
  CHECK(unknown.pairs[0].state == scene::Proximity::kNear);
  CHECK(SceneStatusOf(unknown).unmeasured == 1);
  CHECK(SceneStatusOf(unknown).object_a == 0);
  CHECK_FALSE(unknown.distances[0].distance_m);
  CHECK(watched.logged.size() == 1);

  watched.view.state.alarms = 0;
  // Joint 1 turns the tool towards the wall, whichever its sign is, and away again.
  const double home = watched.view.state.q[0];
  const auto turned = [&](double rad) {
    watched.view.state.q[0] = home + rad;
    return watched.view.Placed().tool->tip_W.y();
  };
  const double towards = turned(0.02) > turned(-0.02) ? 0.02 : -0.02;
  turned(towards);
  const MeasuredPair hit = watched.Measure().pairs[0];
  CHECK(hit.state == scene::Proximity::kInterference);
  REQUIRE(hit.separation);
  CHECK(hit.separation->depth_m > 0.001);
  REQUIRE(watched.logged.size() == 2);
  CHECK_THAT(watched.logged[1], Catch::Contains("interference of box and wall begins"));
  turned(-10 * towards);
  CHECK(watched.Measure().pairs[0].state == scene::Proximity::kApart);
  CHECK(watched.logged.size() == 3);
  CHECK_THAT(watched.logged[2], Catch::Contains("interference of box and wall has ended"));
  CHECK(watched.events == std::vector{log::Event::kInterferenceNear,
                                      log::Event::kInterferenceBegins,
                                      log::Event::kInterferenceEnds});
}

TEST_CASE("an object without a mesh is not measured") {
  MeasuredScene watched;
  watched.PlaceWall(0.5);
  watched.scene->meshes[1] = nullptr;
  const SceneMeasurements measured = watched.Measure();
  CHECK_FALSE(measured.pairs[0].separation);
  CHECK_FALSE(measured.sweeps[0].result);
}

TEST_CASE("an incomplete scene does not replace the previous one") {
  MeasuredScene watched;
  watched.PlaceWall(0.5);
  watched.Measure();
  watched.scene = std::make_shared<SceneSnapshot>();
  watched.scene->version = 99;
  watched.scene->complete = false;
  CHECK(watched.Measure().pairs.size() == 1);
  watched.scene = std::make_shared<SceneSnapshot>(*watched.scene);
  watched.scene->complete = true;
  CHECK(watched.Measure().pairs.empty());
}

}  // namespace plumbline::scene_measurer_test
