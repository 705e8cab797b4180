// Distances and interference of a small scene: two cuboids, one on the flange, one in the cell.
#include "app/view_process/measuring.h"

#include <catch2/catch.hpp>

#include "tests/app/scene/shapes.h"
#include "tests/app/view/view_scene.h"

using namespace plumbline;
using namespace plumbline::test;

namespace {

MeshOfObject Box(float side) {
  auto checked = CheckMesh(Cuboid({side, side, side}), 1);
  REQUIRE(checked);
  return std::make_shared<const CheckedMesh>(std::move(checked).value());
}

struct Watched {
  ViewScene view;
  std::vector<std::string> told;
  std::vector<Event> events;
  Measuring measuring{0, [this](const LogEntry& entry) {
                        told.push_back(entry.text);
                        events.push_back(entry.event);
                      }};
  std::shared_ptr<SceneNow> scene = std::make_shared<SceneNow>();

  /// A cuboid of 0.2 m at the tool's tip; a wall of 0.2 m whose centre is `apart_m` further along
  /// x.
  void Stand(double apart_m) {
    const Carriers carriers = view.Placed();
    REQUIRE(carriers.tool);
    scene = std::make_shared<SceneNow>(*scene);
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
    const BendStation& tip = carriers.tool->bend.stations.back();
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
  Measured Measure() {
    measuring.Take(scene);
    return measuring.Measure({ViewScene::kNow_s, view.Placed()}, ViewScene::kNow_s);
  }
};

}  // namespace

TEST_CASE("the bent tool's box and a wall: apart, near, interference, and the end of it") {
  Watched watched;
  watched.Stand(0.5);
  Measured measured = watched.Measure();
  const SceneStatus told = SceneForPlc(measured);
  CHECK(told.interferences == 0);
  CHECK(told.object_a == 4);
  CHECK(told.object_b == 9);
  CHECK(told.smallest_m == Approx(0.3).margin(5e-4));
  REQUIRE(measured.pairs.size() == 1);
  REQUIRE(measured.pairs[0].separation);
  // The box is bent with the tool: its sections turn by milliradians, its sides by micrometres.
  CHECK(measured.pairs[0].separation->distance_m == Approx(0.3).margin(5e-4));
  CHECK(measured.pairs[0].state == Nearness::kApart);
  CHECK(watched.told.empty());
  REQUIRE(measured.distances.size() == 1);
  REQUIRE(measured.distances[0].distance_m);
  CHECK(*measured.distances[0].distance_m == Approx(0.3).margin(5e-4));
  REQUIRE(measured.sweeps.size() == 1);
  REQUIRE(measured.sweeps[0].result);
  CHECK(measured.sweeps[0].result->hits);
  CHECK(measured.sweeps[0].other == "wall");
}

TEST_CASE("begin and end of interference are told once each, nearness too") {
  Watched watched;
  watched.Stand(0.22);
  CHECK(watched.Measure().pairs[0].state == Nearness::kNear);
  watched.Measure();
  REQUIRE(watched.told.size() == 1);
  CHECK_THAT(watched.told[0], Catch::Contains("box and wall are near: 2"));

  // The cell's marks out of sight: what stands on the flange and in W is placed by the robot.
  watched.view.state.cameras[0].bodies.clear();
  CHECK(watched.Measure().pairs[0].separation);
  // The robot is not trusted: nothing is measured, and nothing has ended.
  watched.view.state.alarms = alarm::kRobotStale;
  const Measured unknown = watched.Measure();
  CHECK_FALSE(unknown.pairs[0].separation);
  CHECK(unknown.pairs[0].state == Nearness::kNear);
  CHECK(SceneForPlc(unknown).unmeasured == 1);
  CHECK(SceneForPlc(unknown).object_a == 0);
  CHECK_FALSE(unknown.distances[0].distance_m);
  CHECK(watched.told.size() == 1);

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
  CHECK(hit.state == Nearness::kInterference);
  REQUIRE(hit.separation);
  CHECK(hit.separation->depth_m > 0.001);
  REQUIRE(watched.told.size() == 2);
  CHECK_THAT(watched.told[1], Catch::Contains("interference of box and wall begins"));
  turned(-10 * towards);
  CHECK(watched.Measure().pairs[0].state == Nearness::kApart);
  CHECK(watched.told.size() == 3);
  CHECK_THAT(watched.told[2], Catch::Contains("interference of box and wall has ended"));
  CHECK(watched.events == std::vector{Event::kInterferenceNear, Event::kInterferenceBegins,
                                      Event::kInterferenceEnds});
}

TEST_CASE("a mesh that is not there yet: not measured, and no fault") {
  Watched watched;
  watched.Stand(0.5);
  watched.scene->meshes[1] = nullptr;
  const Measured measured = watched.Measure();
  CHECK_FALSE(measured.pairs[0].separation);
  CHECK_FALSE(measured.sweeps[0].result);
}

TEST_CASE("a scene that is still being read does not take the place of the one before") {
  Watched watched;
  watched.Stand(0.5);
  watched.Measure();
  watched.scene = std::make_shared<SceneNow>();
  watched.scene->version = 99;
  watched.scene->complete = false;
  CHECK(watched.Measure().pairs.size() == 1);
  watched.scene = std::make_shared<SceneNow>(*watched.scene);
  watched.scene->complete = true;
  CHECK(watched.Measure().pairs.empty());
}
