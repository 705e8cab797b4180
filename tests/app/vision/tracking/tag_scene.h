// Rendered tags with known corners and poses.
#pragma once

#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "app/vision/tracking/tag_detector.h"
#include "tests/app/rendered_image.h"
#include "tests/renderer/scene.h"

namespace plumbline::test {

/// The cells of a tag, row by row, 1 white, with its black border.
inline std::vector<bool> CellsOf(const target::TagFamily& family, int id, int border = 1) {
  const int n = family.data_cells;
  std::vector<bool> white;
  for (int r = -border; r < n + border; ++r) {
    for (int c = -border; c < n + border; ++c) {
      const bool data = r >= 0 && c >= 0 && r < n && c < n;
      white.push_back(data && ((family.codes[id] >> (n * n - 1 - (r * n + c))) & 1) != 0);
    }
  }
  return white;
}

/// A tag at a pose, with a white margin of one cell.
inline renderer::Sheet TagSheet(const target::TagFamily& family, int id, double side_m,
                                const Eigen::Isometry3d& X_CM, int border = 1) {
  renderer::Sheet sheet;
  sheet.print =
      renderer::SquareTag(family.data_cells + 2 * border, CellsOf(family, id, border), side_m);
  sheet.X_CK = X_CM;
  sheet.half_width_m = sheet.half_height_m = 0.5 * side_m * (1 + 2.0 / family.cells());
  return sheet;
}

/// The tag's corners in its own frame (x right, y down), clockwise from the top left.
inline std::array<Eigen::Vector3d, 4> TagCorners(double side_m) {
  const double h = 0.5 * side_m;
  return {Eigen::Vector3d(-h, -h, 0), {h, -h, 0}, {h, h, 0}, {-h, h, 0}};
}

/// A tag facing the camera, tilted by `tilt` about an axis in its plane, rotated by `roll`.
inline Eigen::Isometry3d FacingPose(const Eigen::Vector3d& p_CM, double tilt, double tilt_axis,
                                    double roll) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.translation() = p_CM;
  X.linear() =
      (Eigen::AngleAxisd(tilt, Eigen::Vector3d(std::cos(tilt_axis), std::sin(tilt_axis), 0)) *
       Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()))
          .toRotationMatrix();
  return X;
}

/// The point at a given depth on the ray through a pixel, for an undistorted pinhole.
inline Eigen::Vector3d PointAt(const renderer::Camera& c, double u, double v, double depth_m) {
  return depth_m * Eigen::Vector3d((u - c.cx) / c.fx, (v - c.cy) / c.fy, 1);
}

struct TagScene {
  renderer::Camera camera;
  double side_m = 0.08;
  int border = 1;  ///< in cells
  std::vector<int> ids;
  std::vector<renderer::Sheet> sheets;
  std::vector<vision::Corners> corners;  ///< the truth [px]

  void Add(const target::TagFamily& family, int id, const Eigen::Isometry3d& X_CM) {
    ids.push_back(id);
    sheets.push_back(TagSheet(family, id, side_m, X_CM, border));
    vision::Corners at;
    const auto own = TagCorners(side_m);
    for (int k = 0; k < 4; ++k) at[k] = renderer::PixelOf(camera, X_CM * own[k]);
    corners.push_back(at);
  }
};

/// Six randomly placed tags of 80 mm, about `side_px` large and tilted by up to `most_tilt`.
inline TagScene SixTags(const target::TagFamily& family, const renderer::Camera& camera,
                        double side_px, double most_tilt, std::uint64_t seed, int border = 1) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  TagScene scene;
  scene.camera = camera;
  scene.border = border;
  const double depth = camera.fx * scene.side_m / side_px;
  for (int k = 0; k < 6; ++k) {
    const double u = camera.width * (0.5 + (k % 3 - 1) * 0.3 + 0.04 * uniform(random));
    const double v = camera.height * (0.5 + (k < 3 ? -0.225 : 0.225) + 0.04 * uniform(random));
    scene.Add(family, static_cast<int>(random() % family.codes.size()),
              FacingPose(PointAt(camera, u, v, depth * (1 + 0.1 * uniform(random))),
                         most_tilt * uniform(random), std::numbers::pi * uniform(random),
                         std::numbers::pi * uniform(random)));
  }
  return scene;
}

}  // namespace plumbline::test
