#include <catch2/catch.hpp>

#include "tests/app/display/view/view_scene.h"

namespace plumbline::carriers_test {

using namespace plumbline::cell;
using namespace plumbline::test;

TEST_CASE("the cell frame follows from the cell tags, the tip from the loaded arm") {
  ViewScene scene;
  const Carriers carriers = scene.Placed();
  REQUIRE(carriers.world);
  CHECK_FALSE(carriers.world->stale);
  CHECK((carriers.world->X_CK.p - scene.X_CW.p).norm() < 1e-9);
  REQUIRE(carriers.tool);
  REQUIRE(carriers.flange);

  deflection::LoadedState loaded;
  REQUIRE(scene.model->arm.AtCommanded(scene.state.q, {40, scene.state.payload_cog_F}, {}, loaded));
  const scene::BendField& bend = carriers.tool->bend;
  REQUIRE(bend.length_m > 0);
  const Vec3 tip_F = scene::BentPoint(bend, Vec3(0, 0, static_cast<double>(bend.length_m)));
  const Vec3 tip_C = carriers.flange->X_CK * tip_F;
  CHECK((tip_C - scene.X_CW * loaded.X_WT.p).norm() < 1e-5);
  CHECK((tip_C - Vec3(0.02, -0.03, 1.5)).norm() < 1e-5);
  // The nominal tip is where the controller assumes it to be: millimetres away.
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

TEST_CASE("the tool is bent by the motion, but only if it exceeds the noise of the readings") {
  ViewScene scene;
  const Vec3 still = scene.Placed().tool->tip_W;
  ViewMotion& motion = scene.state.motion;
  motion.state = motion::MotionState::kMoving;
  motion.sag = model::JointVector::Zero(6);
  motion.sag[0] = 2e-4;
  motion.acceleration_F = Vec3(3, 0, 0);
  motion.tip_W = Vec3(0, 0, 1e-3);
  motion.radius_m = 2e-3;
  CHECK((scene.Placed().tool->tip_W - still).norm() == 0);
  motion.radius_m = 1e-4;
  const ToolState moving = *scene.Placed().tool;
  const double length_m = static_cast<double>(moving.bend.length_m);
  CHECK((moving.X_WF * scene::BentPoint(moving.bend, Vec3(0, 0, length_m)) - moving.tip_W).norm() <
        2e-5);
  // The tip lags in the direction opposite to the acceleration of the flange, and turns with
  // joint 1.
  scene.state.motion.acceleration_F.setZero();
  const Vec3 by_joint = scene.Placed().tool->tip_W - still;
  CHECK(by_joint.norm() ==
        Approx(2e-4 * (still - scene.model->arm.X_WB().p).head<2>().norm()).epsilon(0.02));
  const Vec3 by_tool = moving.tip_W - still - by_joint;
  CHECK((moving.X_WF.R.transpose() * by_tool).x() < -1e-5);
}

TEST_CASE("a hidden carrier becomes stale, then is dropped; the cell frame is kept") {
  ViewScene scene;
  scene.Placed();
  scene.state.cameras[0].bodies.clear();
  scene.state.cameras[0].tags.clear();
  const auto later = [&](double s) {
    scene.state.now_s = ViewScene::kNow_s + s - 0.02;
    scene.state.cameras[0].image->time_s = ViewScene::kNow_s + s - 0.03;
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

TEST_CASE("a new lens drops every pose estimated with the previous one") {
  ViewScene scene;
  scene.Placed();
  scene.state.cameras[0].bodies.clear();
  scene.state.cameras[0].tags.clear();
  scene.state.cameras[0].lens->fx += 1;
  const Carriers carriers = scene.Placed();
  CHECK_FALSE(carriers.world);
  CHECK_FALSE(carriers.flange);
  CHECK(carriers.bodies.empty());
}

TEST_CASE("an invalid lens, an old image or an untrusted robot reading makes carriers stale") {
  ViewScene scene;
  SECTION("lens") {
    scene.state.cameras[0].status.state = lens::ZoomState::kMoving;
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
  SECTION("daemon: what it reported last holds for neither lens nor robot") {
    scene.state.now_s -= 2;
    const Carriers carriers = scene.Placed();
    CHECK_FALSE(carriers.image_stale);
    CHECK(carriers.lens_stale);
    CHECK(carriers.robot_stale);
    CHECK(carriers.flange->stale);
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
    scene.state.cameras[0].bodies[0].ambiguous = true;
    CHECK_FALSE(scene.Placed().world);
  }
}

TEST_CASE("the viewer reads the model version that the daemon has in force and writes nothing") {
  ViewScene scene;
  config::FaultList faults;
  CHECK_FALSE(ReadViewModel(scene.ConfigFile(), 3, faults));
  CHECK_THAT(FaultsText(faults), Catch::Contains("model version 3 is in force but cannot be read"));
  CHECK_FALSE(std::filesystem::exists(scene.folder.path() + "/state"));

  std::filesystem::create_directories(scene.folder.path() + "/state/models");
  std::string cell = FileText("tests/virtual_cell/demo/cockpit-cell.toml");
  cell = WithLine(cell, "robot", "name", "\"another\"");
  std::ofstream(scene.folder.path() + "/state/models/0003.toml") << cell;
  config::FaultList none;
  const auto model = ReadViewModel(scene.ConfigFile(), 3, none);
  INFO(FaultsText(none));
  REQUIRE(model);
  CHECK(model->config.machine.cell.robot.name == "another");
  CHECK(model->version == 3);
}

namespace {

/// A second camera, to the right of the first and turned towards the same spot.
const Pose kRearFromSide{RotationFromVector(Vec3(0, 0.5, 0)), Vec3(-0.7, 0, 0.2)};

/// The scene with this second camera, which sees only the cell.
struct TwoCameras : ViewScene {
  std::array<CarrierTracker, 2> memories;

  TwoCameras() {
    state.cameras.push_back(state.cameras[0]);
    ViewCamera& rear = state.cameras[1];
    rear.lens->fx = 2400;
    rear.bodies = {{"cell", kRearFromSide * X_CW * kMarksInW, false}};
    rear.tags.clear();
  }
  std::vector<Carriers> Placed(double now_s = kNow_s) {
    std::vector<Carriers> placed;
    for (std::size_t k = 0; k < 2; ++k) {
      placed.push_back(memories[k].Update(state, k, &*model, now_s));
    }
    return placed;
  }
};

const Carrier kGripper{Carrier::Kind::kBody, "gripper", 0}, kTag{Carrier::Kind::kTag, "", 20};

}  // namespace

TEST_CASE("a body seen by one camera is placed in the other's picture through the cell frame") {
  TwoCameras scene;
  std::vector<Carriers> cameras = scene.Placed();
  CHECK(cameras[1].Find(kGripper) == nullptr);
  const Pose own = cameras[0].Find(kGripper)->X_CK;
  ShareDetections(cameras);
  for (const Carrier& carrier : {kGripper, kTag}) {
    const PlacedCarrier* const lent = cameras[1].Find(carrier);
    REQUIRE(lent != nullptr);
    CHECK_FALSE(lent->stale);
    const Pose expected = kRearFromSide * cameras[0].Find(carrier)->X_CK;
    CHECK((lent->X_CK.p - expected.p).norm() < 1e-9);
    CHECK((lent->X_CK.R - expected.R).norm() < 1e-9);
  }
  CHECK(cameras[0].Find(kGripper)->X_CK.p == own.p);

  SECTION("its own detections are not replaced") {
    scene.state.cameras[1].bodies.push_back({"gripper", {Mat3::Identity(), Vec3(9, 9, 9)}, false});
    cameras = scene.Placed();
    ShareDetections(cameras);
    CHECK(cameras[1].Find(kGripper)->X_CK.p == Vec3(9, 9, 9));
    CHECK(cameras[0].Find(kGripper)->X_CK.p == own.p);
  }
  SECTION("a camera with a stale lens neither contributes nor receives") {
    for (const std::size_t stale : {0, 1}) {
      scene.state.cameras[stale].status.state = lens::ZoomState::kStale;
      cameras = scene.Placed();
      ShareDetections(cameras);
      CHECK(cameras[1].Find(kGripper) == nullptr);
      scene.state.cameras[stale].status.state = lens::ZoomState::kValid;
    }
  }
}

TEST_CASE("in the measurement frame the camera with the highest resolution determines a pose") {
  TwoCameras scene;
  const auto gripper_W = [&] { return MergeInMeasurementFrame(scene.Placed()).InWorld(kGripper); };
  const Vec3 by_side = scene.X_CW.Inverse() * scene.state.cameras[0].bodies[1].X_CK.p;
  REQUIRE(gripper_W());
  CHECK((gripper_W()->p - by_side).norm() < 1e-9);
  // The rear camera sees it 1 mm away; it is nearer and has a longer focal length.
  Pose X_RK = kRearFromSide * scene.state.cameras[0].bodies[1].X_CK;
  X_RK.p.y() += 0.001;
  scene.state.cameras[1].bodies.push_back({"gripper", X_RK, false});
  const Vec3 by_rear = (kRearFromSide * scene.X_CW).Inverse() * X_RK.p;
  CHECK((gripper_W()->p - by_rear).norm() < 1e-9);
  scene.state.cameras[1].lens->fx = 300;
  CHECK((gripper_W()->p - by_side).norm() < 1e-9);
  scene.state.cameras[0].status.state = lens::ZoomState::kStale;
  CHECK((gripper_W()->p - by_rear).norm() < 1e-9);
  scene.state.cameras[1].status.state = lens::ZoomState::kStale;
  CHECK_FALSE(gripper_W());
  // With a single camera, its detections are used unchanged.
  ViewScene one;
  const Carriers own = one.Placed();
  const Carriers merged = MergeInMeasurementFrame(std::span(&own, 1));
  for (const Carrier& carrier : {kGripper, kTag, Carrier{Carrier::Kind::kBase, "", 0},
                                 Carrier{Carrier::Kind::kFlange, "", 0}}) {
    REQUIRE(merged.InWorld(carrier));
    CHECK((merged.InWorld(carrier)->p - own.InWorld(carrier)->p).norm() < 1e-9);
  }
}

}  // namespace plumbline::carriers_test
