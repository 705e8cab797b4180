#include <catch2/catch.hpp>

#include "tests/app/view/view_scene.h"

using namespace plumbline;
using namespace plumbline::test;

TEST_CASE("the cell's frame from its marks, the tip where the loaded arm has it") {
  ViewScene scene;
  const Carriers carriers = scene.Placed();
  REQUIRE(carriers.world);
  CHECK_FALSE(carriers.world->stale);
  CHECK((carriers.world->X_CK.p - scene.X_CW.p).norm() < 1e-9);
  REQUIRE(carriers.tool);
  REQUIRE(carriers.flange);

  LoadedState loaded;
  REQUIRE(scene.model->arm.AtCommanded(scene.state.q, {40, scene.state.payload_cog_F}, {}, loaded));
  const BendField& bend = carriers.tool->bend;
  REQUIRE(bend.length_m > 0);
  const Vec3 tip_F = BentPoint(bend, Vec3(0, 0, static_cast<double>(bend.length_m)));
  const Vec3 tip_C = carriers.flange->X_CK * tip_F;
  CHECK((tip_C - scene.X_CW * loaded.X_WT.p).norm() < 1e-5);
  CHECK((tip_C - Vec3(0.02, -0.03, 1.5)).norm() < 1e-5);
  // The nominal tip is where the controller believes it is: millimetres away.
  CHECK((carriers.tool->tip_nominal_W - scene.model->arm.UnloadedTip(scene.state.q).p).norm() <
        1e-9);
  CHECK((carriers.tool->tip_nominal_W - carriers.tool->tip_W).norm() > 1e-3);

  CHECK(carriers.Find({Carrier::Kind::kBody, "gripper", 0}) != nullptr);
  CHECK(carriers.Find({Carrier::Kind::kBody, "door", 0}) == nullptr);
  CHECK(carriers.Find({Carrier::Kind::kTag, "", 20}) != nullptr);
  const auto in_world = carriers.InWorld({Carrier::Kind::kBody, "cell", 0});
  REQUIRE(in_world);
  CHECK((in_world->p - kMarksInW.p).norm() < 1e-9);
}

TEST_CASE("what is hidden stays for a moment, is stale, and is forgotten; the cell's frame stays") {
  ViewScene scene;
  scene.Placed();
  scene.state.camera.bodies.clear();
  scene.state.camera.tags.clear();
  const auto later = [&](double s) {
    scene.state.now_s = ViewScene::kNow_s + s - 0.02;
    scene.state.camera.image->time_s = ViewScene::kNow_s + s - 0.03;
    return scene.Placed(ViewScene::kNow_s + s);
  };
  const Carrier gripper{Carrier::Kind::kBody, "gripper", 0};
  const Carriers soon = later(0.3), after_1_s = later(1), after_5_s = later(5);
  CHECK_FALSE(soon.Find(gripper)->stale);
  CHECK(after_1_s.Find(gripper)->stale);
  CHECK(after_1_s.tags.size() == 3);
  CHECK_FALSE(after_1_s.world->stale);
  CHECK(after_5_s.Find(gripper) == nullptr);
  CHECK(after_5_s.tags.empty());
  REQUIRE(after_5_s.world);
  CHECK(after_5_s.world->stale);
  CHECK_FALSE(after_5_s.InWorld({Carrier::Kind::kBase, "", 0}));
}

TEST_CASE("another lens forgets all that was seen through the former") {
  ViewScene scene;
  scene.Placed();
  scene.state.camera.bodies.clear();
  scene.state.camera.tags.clear();
  scene.state.camera.lens->fx += 1;
  const Carriers carriers = scene.Placed();
  CHECK_FALSE(carriers.world);
  CHECK_FALSE(carriers.flange);
  CHECK(carriers.bodies.empty());
}

TEST_CASE("a lens that is not valid, an old image, an untrusted robot: stale") {
  ViewScene scene;
  SECTION("lens") {
    scene.state.watch.state = ZoomState::kMoving;
    const Carriers carriers = scene.Placed();
    CHECK(carriers.lens_stale);
    CHECK(carriers.world->stale);
    CHECK(carriers.flange->stale);
    CHECK(carriers.bodies.at("gripper").stale);
  }
  SECTION("image") {
    scene.Placed();
    const Carriers carriers = scene.Placed(ViewScene::kNow_s + 10);
    CHECK(carriers.image_stale);
    CHECK(carriers.world->stale);
    CHECK(carriers.bodies.at("gripper").stale);  // still where the image shows it
  }
  SECTION("robot") {
    scene.state.alarms = alarm::kRobotStale;
    const Carriers carriers = scene.Placed();
    CHECK(carriers.robot_stale);
    CHECK(carriers.flange->stale);
    CHECK_FALSE(carriers.world->stale);
    CHECK_FALSE(carriers.InWorld({Carrier::Kind::kFlange, "", 0}));
  }
  SECTION("payload unknown: no bend, no flange") {
    scene.state.payload_kg.reset();
    const Carriers carriers = scene.Placed();
    CHECK_FALSE(carriers.tool);
    CHECK_FALSE(carriers.flange);
    CHECK(carriers.world);
  }
  SECTION("joints of another arm") {
    scene.state.q.conservativeResize(4);
    CHECK_FALSE(scene.Placed().tool);
  }
  SECTION("an ambiguous body is not taken") {
    scene.state.camera.bodies[0].ambiguous = true;
    CHECK_FALSE(scene.Placed().world);
  }
}

TEST_CASE("the model is the version that the daemon has in force, and nothing is written") {
  ViewScene scene;
  FaultList faults;
  CHECK_FALSE(ReadViewModel(scene.ConfigFile(), 3, faults));
  CHECK_THAT(FaultsText(faults), Catch::Contains("version 3 is in force, but cannot be read"));
  CHECK_FALSE(std::filesystem::exists(scene.folder.path() + "/state"));

  std::filesystem::create_directories(scene.folder.path() + "/state/models");
  std::string cell = FileText("tests/virtual_cell/demo/cockpit-cell.toml");
  cell = WithLine(cell, "robot", "name", "\"another\"");
  std::ofstream(scene.folder.path() + "/state/models/0003.toml") << cell;
  FaultList none;
  const auto model = ReadViewModel(scene.ConfigFile(), 3, none);
  INFO(FaultsText(none));
  REQUIRE(model);
  CHECK(model->config.machine.cell.robot.name == "another");
  CHECK(model->version == 3);
}
