// Tracking through rendered sequences.
#include "app/vision/tracking/tracker.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/app/vision/tracking/tag_scene.h"

namespace plumbline::tracker_test {

using namespace plumbline::vision;

namespace {

renderer::Camera Camera() {
  return renderer::Pinhole(800, 600, 1000);
}

struct Shot {
  renderer::Image image;
  std::vector<Corners> corners;
};

Shot ShotOf(const target::TagFamily& family, const std::vector<Eigen::Isometry3d>& poses,
            std::uint64_t seed, const renderer::Conditions& light = {}) {
  test::TagScene scene;
  scene.camera = Camera();
  for (std::size_t k = 0; k < poses.size(); ++k)
    scene.Add(family, 10 + static_cast<int>(k), poses[k]);
  return {renderer::Render(scene.camera, scene.sheets, light, seed), scene.corners};
}

}  // namespace

TEST_CASE("Moving tags are followed without a search of the whole image") {
  const target::TagFamily family = *target::TagFamilyOfName("36h11");
  const lens::KnownLens lens{test::LensOfCamera(Camera())};
  target::TagDatabase database;
  database.default_side_m = 0.08;
  Tracker tracker(family, database, {.full_search_interval = 5});
  for (int frame = 0; frame < 8; ++frame) {
    const double t = 0.04 * frame;
    const auto shot = ShotOf(family,
                             {test::FacingPose({-0.2 + 0.5 * t, -0.1, 1}, 0.3, 1, 2 * t),
                              test::FacingPose({0.2, 0.1 - 0.3 * t, 1.2}, 0.4, 2, -t)},
                             frame);
    const TrackedFrame& seen = tracker.Update(test::ViewOf(shot.image), t, &lens);
    CHECK(seen.full_search == (frame % 5 == 0));
    REQUIRE(seen.tags.size() == 2);
    for (int k = 0; k < 2; ++k) {
      CHECK(seen.tags[k].seen.id == 10 + k);
      CHECK(seen.tags[k].estimate);
      for (int c = 0; c < 4; ++c)
        CHECK((seen.tags[k].seen.corners_px[c] - shot.corners[k][c]).norm() < 0.1);
    }
  }
}

TEST_CASE("A tag that jumped is found in the same frame; one that left is dropped") {
  const target::TagFamily family = *target::TagFamilyOfName("36h11");
  Tracker tracker(family, {}, {});
  const auto here = ShotOf(family, {test::FacingPose({-0.25, -0.1, 1}, 0.3, 1, 0)}, 1);
  const auto there = ShotOf(family, {test::FacingPose({0.25, 0.1, 1}, 0.3, 1, 1)}, 2);
  const auto gone = ShotOf(family, {}, 3);
  CHECK(tracker.Update(test::ViewOf(here.image), 0, nullptr).tags.size() == 1);
  const TrackedFrame& jumped = tracker.Update(test::ViewOf(there.image), 0.04, nullptr);
  CHECK(jumped.full_search);
  REQUIRE(jumped.tags.size() == 1);
  CHECK_FALSE(jumped.tags[0].estimate);  // no lens: corners only
  CHECK(tracker.Update(test::ViewOf(gone.image), 0.08, nullptr).tags.empty());
  CHECK(tracker.Update(test::ViewOf(here.image), 0.12, nullptr).tags.size() == 1);
}

TEST_CASE(
    "An ambiguous tag follows its previous pose; at first sight it is reported as ambiguous") {
  const target::TagFamily family = *target::TagFamilyOfName("36h11");
  const lens::KnownLens lens{test::LensOfCamera(Camera())};
  target::TagDatabase database;
  database.default_side_m = 0.08;
  renderer::Conditions dim;
  dim.black = 60;
  dim.white = 100;
  dim.noise = 4;
  const auto X = [](double depth, double tilt) {
    return test::FacingPose({0.02, 0.01, depth}, tilt, 0.7, 0.2);
  };
  int ambiguous_alone = 0, flips = 0;
  Tracker tracker(family, database, {});
  for (int frame = 0; frame < 16; ++frame) {
    // It moves away from the camera until its two poses are inseparable.
    const double depth = 0.8 + 0.12 * frame;
    const auto shot = ShotOf(family, {X(depth, 0.35)}, frame, dim);
    const TrackedFrame& seen = tracker.Update(test::ViewOf(shot.image), 0.04 * frame, &lens);
    REQUIRE(seen.tags.size() == 1);
    REQUIRE(seen.tags[0].estimate);
    const Pose truth{X(depth, 0.35).linear(), X(depth, 0.35).translation()};
    flips += AngleBetween(seen.tags[0].estimate->X_CK, truth) > 0.35 ? 1 : 0;
    CHECK_FALSE(seen.tags[0].ambiguous);
    Tracker alone(family, database, {});
    ambiguous_alone += alone.Update(test::ViewOf(shot.image), 0, &lens).tags[0].ambiguous ? 1 : 0;
  }
  CHECK(flips == 0);
  CHECK(ambiguous_alone > 0);
}

TEST_CASE("A body resolves the ambiguity of its tag") {
  const target::TagFamily family = *target::TagFamilyOfName("36h11");
  const lens::KnownLens lens{test::LensOfCamera(Camera())};
  target::TagDatabase database;
  target::Body body{"part", {}};
  std::vector<Eigen::Isometry3d> poses;
  const Eigen::Isometry3d X = test::FacingPose({0, 0, 2.6}, 0.3, 1.1, 0.1);
  for (int k = 0; k < 4; ++k) {
    Eigen::Isometry3d at = Eigen::Isometry3d::Identity();
    at.translation() = Vec3(k % 2 == 0 ? -0.4 : 0.4, k / 2 == 0 ? -0.3 : 0.3, 0);
    body.tags.push_back({10 + k, 0.08, {at.linear(), at.translation()}});
    poses.push_back(X * at);
  }
  database.bodies.push_back(body);
  const auto shot = ShotOf(family, poses, 5);
  Tracker tracker(family, database, {});
  const TrackedFrame& seen = tracker.Update(test::ViewOf(shot.image), 0, &lens);
  REQUIRE(seen.bodies.size() == 1);
  CHECK_FALSE(seen.bodies[0].ambiguous);
  CHECK((seen.bodies[0].estimate.X_CK.p - X.translation()).norm() < 0.002);
  REQUIRE(seen.tags.size() == 4);
  for (std::size_t k = 0; k < 4; ++k) {
    const Pose truth{poses[k].linear(), poses[k].translation()};
    CHECK_FALSE(seen.tags[k].ambiguous);
    CHECK(AngleBetween(seen.tags[k].estimate->X_CK, truth) < 0.3);
  }
}

TEST_CASE("A tag outside the lens's usable region has no pose and does not locate its body") {
  const target::TagFamily family = *target::TagFamilyOfName("36h11");
  lens::KnownLens lens{test::LensOfCamera(Camera())};
  lens.size = {800, 600};
  target::TagDatabase database;
  database.default_side_m = 0.08;
  database.bodies = {{"plate", {{10, 0.08, Pose{}}}, {}}};
  Tracker tracker(family, database, {});
  const auto shot = ShotOf(family,
                           {test::FacingPose({-0.25, -0.1, 1}, 0.3, 1, 0),
                            test::FacingPose({0.03, 0.02, 1.2}, 0.4, 2, 0)},
                           5);
  for (const double radius_px : {1000.0, 200.0}) {
    lens.usable_radius_px = radius_px;
    const TrackedFrame& seen = tracker.Update(test::ViewOf(shot.image), radius_px, &lens);
    REQUIRE(seen.tags.size() == 2);
    for (const TrackedTag& tag : seen.tags) {
      const bool outside = radius_px < 500 && tag.seen.id == 10;
      CHECK(tag.estimate.has_value() != outside);
    }
    CHECK(seen.bodies.size() == (radius_px < 500 ? 0 : 1));
  }
}

}  // namespace plumbline::tracker_test
