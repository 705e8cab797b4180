// Tag detection in rendered images with known corners.
#include "app/vision/tracking/tag_detector.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/app/vision/tracking/tag_scene.h"

namespace plumbline::tag_detector_test {

using namespace plumbline::vision;
using test::LensOfCamera;
using test::SixTags;
using test::TagScene;
using test::ViewOf;

namespace {

/// A lens of focal length f with a quarter of the pixels, which renders faster.
renderer::Camera SmallCamera(double f) {
  renderer::Camera camera = renderer::ZoomLens(2 * f);
  camera.width /= 2;
  camera.height /= 2;
  camera.fx /= 2;
  camera.fy /= 2;
  camera.cx = 0.5 * (camera.cx + 0.5) - 0.5;
  camera.cy = 0.5 * (camera.cy + 0.5) - 0.5;
  return camera;
}

struct Score {
  int tags = 0, found = 0, strange = 0;
  double squares = 0, whitened = 0;
  int coordinates = 0;

  double rmse() const { return std::sqrt(squares / coordinates); }
  double z() const { return std::sqrt(whitened / coordinates); }

  void Add(const TagScene& scene, const SeenTags& seen) {
    tags += static_cast<int>(scene.ids.size());
    for (const SeenTag& tag : seen.tags) {
      bool known = false;
      for (std::size_t k = 0; k < scene.ids.size(); ++k) {
        if (scene.ids[k] != tag.id || (scene.corners[k][0] - tag.corners_px[0]).norm() > 4)
          continue;
        known = true;
        Eigen::Matrix<double, 8, 1> error;
        for (Eigen::Index c = 0; c < 4; ++c) {
          error.segment<2>(2 * c) = tag.corners_px[c] - scene.corners[k][c];
        }
        squares += error.squaredNorm();
        whitened += error.dot(tag.covariance.ldlt().solve(error));
        coordinates += 8;
      }
      (known ? found : strange) += 1;
    }
  }
};

struct Look {
  double side_px = 80, most_tilt = 0.8, focal_px = 600;
  renderer::Conditions light;
  DetectorSettings settings;
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  const char* family = "36h11";
  int border = 1;
};

Score Scored(const Look& look, int scenes) {
  const target::TagFamily family = *target::TagFamilyOfName(look.family);
  TagDetector detector(family, look.settings);
  Score score;
  for (int seed = 0; seed < scenes; ++seed) {
    TagScene scene = SixTags(family, SmallCamera(look.focal_px + 700 * seed), look.side_px,
                             look.most_tilt, seed, look.border);
    const auto image = renderer::Render(scene.camera, scene.sheets, look.light, seed, look.motion);
    if (!look.motion.isApprox(Eigen::Isometry3d::Identity())) {
      // Corners refer to the middle of the exposure.
      Eigen::Isometry3d half = Eigen::Isometry3d::Identity();
      half.translation() = 0.5 * look.motion.translation();
      for (std::size_t k = 0; k < scene.ids.size(); ++k) {
        const auto own = test::TagCorners(scene.side_m);
        for (int c = 0; c < 4; ++c) {
          scene.corners[k][c] =
              renderer::PixelOf(scene.camera, half * (scene.sheets[k].X_CK * own[c]));
        }
      }
    }
    const lens::Lens lens = LensOfCamera(scene.camera);
    SeenTags seen;
    detector.Detect(ViewOf(image), &lens, seen);
    score.Add(scene, seen);
  }
  return score;
}

}  // namespace

TEST_CASE("Six tags through distorting lenses: all found, corner errors match their covariance") {
  const Score score = Scored({}, 6);
  CHECK(score.found == score.tags);
  CHECK(score.strange == 0);
  CHECK(score.rmse() < 0.02);
  CHECK(score.z() > 0.85);
  CHECK(score.z() < 1.25);
}

TEST_CASE("Poor light: contrast 0.08 of the range with noise") {
  Look look;
  look.light.black = 100;
  look.light.white = 100 + 0.08 * 255;
  look.light.background = 108;
  const Score score = Scored(look, 5);
  CHECK(score.found == score.tags);
  CHECK(score.strange == 0);
  CHECK(score.rmse() < 0.15);
  CHECK(score.z() < 1.25);
}

TEST_CASE("Uneven light, ripple over the rows, a busy background") {
  Look look;
  look.light.white = 130;
  look.light.shade_x = 1.2;
  look.light.shade_y = 0.6;
  look.light.flicker = 0.1;
  look.light.clutter = 40;
  const Score score = Scored(look, 3);
  CHECK(score.found == score.tags);
  CHECK(score.strange == 0);
  CHECK(score.rmse() < 0.03);
}

TEST_CASE("Saturated highlights and black level") {
  Look look;
  look.light.white = 300;
  look.light.black = 0;
  const Score score = Scored(look, 3);
  CHECK(score.found == score.tags);
  CHECK(score.rmse() < 0.04);
}

TEST_CASE("Blurred") {
  Look look;
  look.light.blur_px = 2;
  const Score score = Scored(look, 3);
  CHECK(score.found == score.tags);
  CHECK(score.rmse() < 0.05);
}

TEST_CASE("Moved by some pixels during the exposure") {
  Look look;
  look.most_tilt = 0.3;
  look.motion.translation() = Eigen::Vector3d(0.003, 0.001, 0);  // 3 px
  const Score score = Scored(look, 2);
  CHECK(score.found == score.tags);
  CHECK(score.rmse() < 0.08);
}

TEST_CASE("Tilted by up to 60 degrees; small ones at full size") {
  Look look;
  look.most_tilt = 60 * std::numbers::pi / 180;
  look.focal_px = 2500;  // a wide lens would see some of them along their plane
  const Score tilted = Scored(look, 3);
  CHECK(tilted.found == tilted.tags);
  CHECK(tilted.rmse() < 0.03);
  look.side_px = 26;
  look.most_tilt = 0.5;
  look.settings.small_tags = true;
  const Score small = Scored(look, 3);
  CHECK(small.found == small.tags);
  CHECK(small.rmse() < 0.08);
}

TEST_CASE("Small tags: most of 16 px and of 14 px are found, with honest covariances") {
  Look look;
  look.most_tilt = 0.5;
  look.focal_px = 2500;
  look.side_px = 16;
  const Score found_16 = Scored(look, 3);
  CHECK(found_16.found >= found_16.tags - 2);
  CHECK(found_16.rmse() < 0.25);
  CHECK(found_16.z() < 2.5);
  look.side_px = 14;
  const Score found_14 = Scored(look, 3);
  CHECK(found_14.found >= found_14.tags - 5);
  CHECK(found_14.rmse() < 0.35);
  CHECK(found_16.strange + found_14.strange == 0);
}

TEST_CASE("Other families") {
  Look look;
  look.settings.strict = true;
  for (const char* family :
       {"25h9", "16h5", "36h10", "aruco-4x4-50", "aruco-5x5-250", "aruco-7x7-1000"}) {
    look.family = family;
    const Score score = Scored(look, 1);
    CHECK(score.found == score.tags);
    CHECK(score.strange == 0);
    CHECK(score.rmse() < 0.03);
  }
}

TEST_CASE("A border of two cells, as on boards of Kalibr and with borderBits = 2 of OpenCV") {
  for (const char* family : {"36h11", "25h9", "aruco-6x6-250"}) {
    for (const double side_px : {80, 30}) {
      Look look;
      look.family = family;
      look.side_px = side_px;
      look.most_tilt = 0.5;
      look.border = 2;
      const Score score = Scored(look, 5);
      CAPTURE(family, side_px, score.found, score.rmse(), score.z());
      CHECK(score.found >= score.tags - (side_px < 50 ? 2 : 0));
      CHECK(score.strange == 0);
      CHECK(score.rmse() < 0.1);
    }
  }
  Look often_matched;
  often_matched.family = "16h5";
  often_matched.border = 2;
  CHECK(Scored(often_matched, 2).found == 0);
}

TEST_CASE("A threshold set by hand") {
  Look look;
  look.settings.threshold = 120;
  const Score fitting = Scored(look, 1);
  CHECK(fitting.found == fitting.tags);
  look.settings.threshold = 5;  // nothing is that dark
  CHECK(Scored(look, 1).found == 0);
}

TEST_CASE("Covered cells are corrected; a covered corner hides the tag instead of distorting it") {
  const target::TagFamily family = *target::TagFamilyOfName("36h11");
  TagScene scene;
  scene.camera = SmallCamera(1000);
  const Eigen::Isometry3d X = test::FacingPose({0, 0, 0.8}, 0.3, 1, 0.2);
  scene.Add(family, 40, X);
  const auto cover = [&](double x, double y, double size, double shade) {
    renderer::Sheet sheet;
    sheet.print = [=](double, double) { return shade; };
    sheet.half_width_m = sheet.half_height_m = 0.5 * size;
    sheet.X_CK = X;
    sheet.X_CK.translation() = X * Eigen::Vector3d(x, y, -1e-6);
    return sheet;
  };
  const lens::Lens lens = LensOfCamera(scene.camera);
  TagDetector detector(family, {});
  SeenTags seen;
  auto sheets = scene.sheets;
  sheets.push_back(cover(0.005, 0.005, 0.009, 0.0));
  sheets.push_back(cover(0.015, 0.005, 0.009, 1.0));
  detector.Detect(ViewOf(renderer::Render(scene.camera, sheets, {}, 1)), &lens, seen);
  REQUIRE(seen.tags.size() == 1);
  CHECK(seen.tags[0].id == 40);
  CHECK((seen.tags[0].corners_px[0] - scene.corners[0][0]).norm() < 0.05);

  for (const double shade : {0.0, 0.4, 1.0}) {
    sheets = scene.sheets;
    sheets.push_back(cover(-0.04, -0.04, 0.03, shade));
    detector.Detect(ViewOf(renderer::Render(scene.camera, sheets, {}, 1)), &lens, seen);
    for (const SeenTag& tag : seen.tags) {
      CHECK((tag.corners_px[0] - scene.corners[0][0]).norm() < 0.5);
    }
  }
}

TEST_CASE("At the image border: a complete tag is found, a truncated one is not") {
  const target::TagFamily family = *target::TagFamilyOfName("36h11");
  const renderer::Camera camera = SmallCamera(1000);
  const lens::Lens lens = LensOfCamera(camera);
  TagDetector detector(family, {});
  for (const double past : {-4.0, 30.0}) {  // of the left side, beyond the image's edge [px]
    TagScene scene;
    scene.camera = camera;
    scene.Add(family, 7, test::FacingPose(test::PointAt(camera, 50 - past, 250, 0.8), 0, 0, 0));
    const double left = scene.corners[0][0].x();
    SeenTags seen;
    detector.Detect(ViewOf(renderer::Render(camera, scene.sheets, {}, 1)), &lens, seen);
    CHECK(seen.tags.size() == (left > 2 ? 1u : 0u));
    for (const SeenTag& tag : seen.tags) {
      CHECK((tag.corners_px[0] - scene.corners[0][0]).norm() < 0.05);
    }
  }
}

}  // namespace plumbline::tag_detector_test
