// Rendered cell for tests with a recorded camera: one image file, replaced while the camera runs.
#pragma once

#include <filesystem>
#include <sstream>
#include <string>

#include "app/vision/camera/board_session.h"
#include "tests/app/vision/camera/outline_pose.h"
#include "tests/app/vision/camera/reference_tag_scene.h"
#include "tests/app/vision/lens/rendered_views.h"
#include "tests/renderer/pgm.h"

namespace plumbline::test {

inline Eigen::Isometry3d IsometryOf(const Pose& X) {
  Eigen::Isometry3d placed = Eigen::Isometry3d::Identity();
  placed.linear() = X.R;
  placed.translation() = X.p;
  return placed;
}

/// A gripper with three tags and its tip 150 mm to the side.
inline target::Body GripperBody() {
  return {"gripper",
          {{20, 0.06, {Mat3::Identity(), Vec3(-0.1, -0.02, 0)}},
           {21, 0.06, {Mat3::Identity(), Vec3(0.1, -0.03, 0.01)}},
           {22, 0.06, {Mat3::Identity(), Vec3(0, 0.07, 0.005)}}}};
}
inline Vec3 GripperTip() {
  return {0.15, 0.02, 0.01};
}
inline Pose GripperInCamera() {
  return {RotationFromRollPitchYaw(Vec3(-0.1, 0.15, 0.3)), Vec3(0.02, 0.03, 1.4)};
}

/// @param turned_rad  by which each tag is turned about its centre: pi as OpenCV draws it
/// @param cell        where the reference tags are
inline renderer::Image DrawCell(const renderer::Camera& camera, const Pose& X_CK, const Pose& X_CT,
                                double turned_rad = 0, const target::Body& cell = CellTags()) {
  const target::TagFamily family = target::TagFamilyOfName("36h11").value();
  const Pose turned{RotationFromVector(Vec3(0, 0, turned_rad)), Vec3::Zero()};
  std::vector<renderer::Sheet> sheets;
  for (const target::BodyTag& tag : cell.tags) {
    sheets.push_back(TagSheet(family, tag.id, tag.side_m, IsometryOf(X_CK * tag.X_KM * turned)));
  }
  for (const target::BodyTag& tag : GripperBody().tags) {
    sheets.push_back(TagSheet(family, tag.id, tag.side_m, IsometryOf(X_CT * tag.X_KM * turned)));
  }
  return renderer::Render(camera, sheets, {}, 1);
}

/// The board in a pose.
inline renderer::Image DrawBoard(const renderer::Camera& camera, const target::Board& board,
                                 const Pose& X_CK, std::uint64_t seed) {
  renderer::Sheet sheet;
  sheet.print = vision::PrintOf(board);
  sheet.X_CK = IsometryOf(X_CK);
  sheet.centre_x_m = board.Centre().x();
  sheet.centre_y_m = board.Centre().y();
  sheet.half_width_m = board.Centre().x() + 2 * board.square_m;
  sheet.half_height_m = board.Centre().y() + 2 * board.square_m;
  return renderer::Render(camera, {sheet}, {}, seed);
}

/// The board near the middle of the image, as a person first shows it.
inline Pose FirstPose(const renderer::Camera& camera, const target::Board& board) {
  const double z_m = camera.fx * (2 * board.Centre().x()) / (0.5 * camera.width);
  return {RotationFromVector(Vec3(0.2, -0.2, 0)),
          Vec3(-board.Centre().x(), -board.Centre().y(), z_m)};
}

/// A person who brings the board to where the display shows it, off by a few degrees and per cent.
class GuidedPerson {
 public:
  GuidedPerson(const renderer::Camera& camera, const target::Board& board)
      : camera_(camera), board_(board) {}

  /// The next image. @param wanted_px  empty: shows the board as it comes to mind
  renderer::Image Next(const std::vector<lens::Vec2>& wanted_px, double roll_rad = 0) {
    ++images_;
    std::mt19937_64 random(images_);
    std::uniform_real_distribution<double> U(-1, 1);
    Pose X = wanted_px.empty() ? FirstPose(camera_, board_)
                               : PoseOfOutline(wanted_px, board_, LensOfCamera(camera_));
    const Vec3 centre_K(board_.Centre().x(), board_.Centre().y(), 0);
    const Vec3 centre_C = (1.02 + 0.02 * U(random)) * (X * centre_K);
    X.R = RotationFromVector(
              Vec3(0.06 * U(random), 0.06 * U(random), 0.03 * U(random) + roll_rad * U(random))) *
          X.R;
    X.p = centre_C - X.R * centre_K;
    return DrawBoard(camera_, board_, X, images_);
  }
  std::uint64_t images() const { return images_; }

 private:
  const renderer::Camera camera_;
  const target::Board board_;
  std::uint64_t images_ = 0;
};

/// A folder with one image, for `kind = "recorded"` with `repeat = true`.
class ShownImage {
 public:
  explicit ShownImage(const std::string& folder) : folder_(folder) {
    std::filesystem::create_directories(folder_ + "/frames");
  }
  std::string path() const { return folder_ + "/frames"; }
  void Show(const renderer::Image& image) const {
    const std::string beside = folder_ + "/next.pgm";
    renderer::WritePgm(beside, image);
    std::filesystem::rename(beside, path() + "/frame.pgm");
  }
  void Hide() const { std::filesystem::remove(path() + "/frame.pgm"); }

 private:
  std::string folder_;
};

/// The tag file of this cell.
inline std::string TagsText() {
  std::string text = "schema = 1\n";
  for (const target::Body& body : {CellTags(), GripperBody()}) {
    text += "[[body]]\nname = \"" + body.name + "\"\n";
    for (const target::BodyTag& tag : body.tags) {
      const Vec3 p = 1e3 * tag.X_KM.p;
      const Vec3 rpy = 180 / std::numbers::pi * RollPitchYawFromRotation(tag.X_KM.R);
      const auto list = [](const Vec3& v) {
        std::ostringstream out;
        out.precision(12);
        out << std::showpoint << "[" << v.x() << ", " << v.y() << ", " << v.z() << "]";
        return out.str();
      };
      text += "[[body.tag]]\nid = " + std::to_string(tag.id) +
              "\nsize_mm = 60.0\nxyz_mm = " + list(p) + "\nrpy_deg = " + list(rpy) + "\n";
    }
  }
  return text;
}

}  // namespace plumbline::test
