// Simulated hand-eye views: projected corners of a target and noisy robot poses.
#pragma once

#include <Eigen/Geometry>
#include <random>
#include <string>
#include <vector>

#include "app/vision/hand_eye/hand_eye.h"
#include "tests/renderer/scene.h"

namespace plumbline::test {

struct Making {
  vision::HandEyeSetup setup = vision::HandEyeSetup::kEyeToHand;
  int views = 20;
  double corner_px = 0.1, robot_m = 0.3e-3, robot_rad = 0.3e-3;
  double tilt_rad = 0.5;     ///< largest turn of the target about two axes
  double spin_rad = 1.5;     ///< and about the third
  double size = 1;           ///< true size of the target / declared size
  std::vector<int> wrong{};  ///< views whose robot pose is that of another
};

struct Made {
  renderer::Camera camera;
  Eigen::Isometry3d camera_pose, target_pose;  ///< X_BC and X_FK, or X_FC and X_BK
  std::vector<vision::HandEyeView> views;
};

inline Eigen::Isometry3d Iso(const Eigen::Vector3d& turn, const Eigen::Vector3d& place) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  if (turn.norm() > 0) X.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()).matrix();
  X.translation() = place;
  return X;
}

inline Pose PoseOfIso(const Eigen::Isometry3d& X) {
  return {X.linear(), X.translation()};
}

/// A board of 9 x 6 corners 30 mm apart, 0.8 to 1.4 m in front of a camera with f = 2000 px.
inline Made Make(const Making& how, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> draw(-1, 1);
  std::normal_distribution<double> normal;
  const auto vector = [&](double size) {
    return Eigen::Vector3d(size * draw(random), size * draw(random), size * draw(random));
  };
  const auto noise = [&](double size) {
    return Eigen::Vector3d(size * normal(random), size * normal(random), size * normal(random));
  };
  Made made;
  made.camera.fx = 2000;
  made.camera.fy = 2004;
  made.camera.distortion[0] = -0.1;
  made.camera.distortion[1] = 0.05;
  made.camera_pose = Iso(vector(2), vector(1.5));
  made.target_pose = Iso(vector(1.5), vector(0.2));
  while (static_cast<int>(made.views.size()) < how.views) {
    const Eigen::Vector3d centre(0.12, 0.075, 0);
    const double distance = 1.1 + 0.3 * draw(random);
    Eigen::Isometry3d X_CK =
        Iso({0, 0, how.spin_rad * draw(random)}, Eigen::Vector3d::Zero()) *
        Iso({how.tilt_rad * draw(random), how.tilt_rad * draw(random), 0}, Eigen::Vector3d::Zero());
    X_CK.translation() =
        Eigen::Vector3d(0.25 * distance * draw(random), 0.12 * distance * draw(random), distance) -
        X_CK.linear() * centre;
    // The robot pose that the image requires.
    const Eigen::Isometry3d X_BF = how.setup == vision::HandEyeSetup::kEyeToHand
                                       ? made.camera_pose * X_CK * made.target_pose.inverse()
                                       : made.target_pose * (made.camera_pose * X_CK).inverse();
    vision::HandEyeView view;
    view.name = "image" + std::to_string(made.views.size()) + ".png";
    bool inside = true;
    for (int k = 0; k < 54; ++k) {
      const int row = k / 9;
      const Eigen::Vector3d p_K(0.03 * (k % 9), 0.03 * row, 0);
      const Eigen::Vector2d pixel = renderer::PixelOf(made.camera, X_CK * (how.size * p_K));
      inside = inside && pixel.x() > 0 && pixel.x() < made.camera.width && pixel.y() > 0 &&
               pixel.y() < made.camera.height;
      view.points_K.push_back(p_K);
      view.pixels.emplace_back(pixel.x() + how.corner_px * normal(random),
                               pixel.y() + how.corner_px * normal(random));
    }
    if (!inside) continue;
    view.X_BF = PoseOfIso(X_BF * Iso(noise(how.robot_rad), noise(how.robot_m)));
    made.views.push_back(std::move(view));
  }
  for (const int k : how.wrong) {
    const std::size_t other = (static_cast<std::size_t>(k) + 7) % made.views.size();
    made.views[static_cast<std::size_t>(k)].X_BF.p = made.views[other].X_BF.p;
  }
  return made;
}

inline lens::KnownLens LensTold(const renderer::Camera& camera) {
  lens::KnownLens known;
  known.lens = {camera.fx,
                camera.fy,
                camera.cx,
                camera.cy,
                camera.distortion[0],
                camera.distortion[1],
                camera.distortion[2],
                camera.distortion[3],
                camera.distortion[4]};
  return known;
}

}  // namespace plumbline::test
