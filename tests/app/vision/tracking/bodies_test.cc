// Pose of bodies with several tags in rendered images.
#include "app/vision/tracking/bodies.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/app/vision/tracking/tag_scene.h"

namespace plumbline::bodies_test {

using namespace plumbline::vision;

namespace {

/// Six tags of 80 mm on a plate of 400 x 200 mm.
target::Body Plate() {
  target::Body body{"gripper", {}};
  for (int k = 0; k < 6; ++k) {
    body.tags.push_back(
        {k + 1, 0.08, {Mat3::Identity(), Vec3((k % 3 - 1) * 0.16, (k < 3 ? -0.06 : 0.06), 0)}});
  }
  return body;
}

struct Shot {
  lens::KnownLens lens;
  Eigen::Isometry3d X_CK;
  std::vector<SeenTag> tags;
};

/// The plate at 1.5 m, f = 5000. @param shifted  index of a displaced tag, and its true pose
Shot ShotOf(const target::Body& body, std::uint64_t seed, int shifted = -1,
            const Vec3& shift = Vec3::Zero()) {
  const target::TagFamily family = *target::TagFamilyOfName("36h11");
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  test::TagScene scene;
  scene.camera = renderer::ZoomLens(5000);
  Shot shot;
  shot.lens.lens = test::LensOfCamera(scene.camera);
  shot.X_CK = test::FacingPose({0.02 * uniform(random), 0.01 * uniform(random), 1.5},
                               0.35 * uniform(random), 3 * uniform(random), 0.15 * uniform(random));
  for (std::size_t k = 0; k < body.tags.size(); ++k) {
    Eigen::Isometry3d X_KM = Eigen::Isometry3d::Identity();
    X_KM.translation() = body.tags[k].X_KM.p;
    if (static_cast<int>(k) == shifted) X_KM.translation() += shift;
    scene.Add(family, body.tags[k].id, shot.X_CK * X_KM);
  }
  const auto image = renderer::Render(scene.camera, scene.sheets, {}, seed);
  TagDetector detector(family, {});
  SeenTags seen;
  detector.Detect(test::ViewOf(image), &shot.lens.lens, seen);
  shot.tags = seen.tags;
  return shot;
}

}  // namespace

TEST_CASE("A tip 300 mm from a body of six tags at 1.5 m") {
  const target::Body body = Plate();
  double squares = 0, turns = 0, whitened = 0;
  constexpr int kShots = 6;
  for (int seed = 0; seed < kShots; ++seed) {
    const Shot shot = ShotOf(body, seed);
    const auto seen = LocateBody(shot.lens, body, shot.tags, std::nullopt);
    REQUIRE(seen);
    CHECK(seen->used.size() == 6);
    CHECK_FALSE(seen->ambiguous);
    const Vec3 tip(0, 0, 0.3);
    const Vec3 error = seen->estimate.X_CK * tip - shot.X_CK * tip;
    squares += error.squaredNorm();
    whitened += error.dot(PointCovariance(seen->estimate, tip).ldlt().solve(error));
    const double turn =
        Eigen::AngleAxisd(seen->estimate.X_CK.R.transpose() * shot.X_CK.linear()).angle();
    turns += turn * turn;
  }
  CHECK(1e3 * std::sqrt(squares / kShots) < 0.1);
  CHECK(std::sqrt(turns / kShots) * 180 / std::numbers::pi < 0.02);
  // chi2 with 18 degrees of freedom: outside of each limit once in 500.
  CHECK(whitened > 5.4);
  CHECK(whitened < 40);
}

TEST_CASE("A tag that was moved is excluded and named") {
  const target::Body body = Plate();
  const Shot shot = ShotOf(body, 11, 2, Vec3(0.004, 0.002, 0));
  const auto seen = LocateBody(shot.lens, body, shot.tags, std::nullopt);
  REQUIRE(seen);
  CHECK(seen->left_out == std::vector<int>{3});
  CHECK(seen->used == std::vector<int>{1, 2, 4, 5, 6});
  CHECK((seen->estimate.X_CK.p - shot.X_CK.translation()).norm() < 1e-4);
}

TEST_CASE("A tag detected twice is not used; a body without a visible tag is not reported") {
  const target::Body body = Plate();
  Shot shot = ShotOf(body, 12);
  shot.tags.push_back(shot.tags.front());
  const auto seen = LocateBody(shot.lens, body, shot.tags, std::nullopt);
  REQUIRE(seen);
  CHECK(seen->used == std::vector<int>{2, 3, 4, 5, 6});
  CHECK_FALSE(LocateBody(shot.lens, {"part", {{77, 0.08, {}}}}, shot.tags, std::nullopt));
  CHECK_FALSE(LocateBody(shot.lens, body, {}, Pose{}));
}

}  // namespace plumbline::bodies_test
