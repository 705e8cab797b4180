// A hand that holds the calibration board in front of a simulated camera.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "firmware-like/geometry/rotation.h"
#include "tests/lens_captures/capture_maker.h"

namespace plumbline::lens_captures {

/// Holds the board of a capture in poses of its own, or where an outline shows it.
class SimulatedHand {
 public:
  /// How a person chooses views without guidance.
  enum class Habit {
    kCasual,    ///< as comes to mind: near the middle of the image, tilted a little
    kByManual,  ///< tilted by up to 37 degrees in all directions, every third view into a corner
  };

  SimulatedHand(const Conditions& conditions, Random& random)
      : c_(conditions), random_(random), bow_(conditions.bow_per_m * Vec3(U(), U(), U())) {
    for (int k = 0; k < c_.board.corners(); ++k)
      print_.emplace_back(c_.print_noise_m * Vec3(N(), N(), 0));
  }

  /// Number of views held so far, of which the conditions' changes depend.
  void CountView() { ++views_; }

  /// The next view by habit.
  vision::BoardView Free(Habit habit) {
    const int number = views_;
    const bool casual = habit == Habit::kCasual;
    const double board_m = c_.board.square_m * (c_.board.columns + 1);
    for (;;) {
      const double share = casual ? Uniform(0.3, 0.65) : Uniform(0.4, 0.67);
      const double z = c_.camera.fx * board_m / (share * c_.width);
      double x = casual ? 0.15 * N() : 0.5 * U(), y = casual ? 0.15 * N() : 0.5 * U();
      if (!casual && number % 3 == 0) {
        x = (number % 2 == 0 ? 1 : -1) * Uniform(0.1, 0.45);
        y = (number / 3 % 2 == 0 ? 1 : -1) * Uniform(0.1, 0.45);
      }
      const Vec3 tilt = casual ? Vec3(0.22 * N(), 0.22 * N(), 0.08 * N())
                               : Vec3(0.65 * U(), 0.65 * U(), 0.5 * U());
      const Vec3 centre_C = z * Vec3(x * c_.width / c_.camera.fx, y * c_.height / c_.camera.fy, 1);
      if (const auto view = Hold(RotationFromVector(tilt), centre_C)) return *view;
    }
  }

  /// The board as a hand holds it for an outline at X_CK: off by a few degrees, by some per cent of
  /// the distance and of the image.
  vision::BoardView Following(const Pose& X_CK) {
    const Vec3 wanted_C = X_CK * Vec3(c_.board.Centre().x(), c_.board.Centre().y(), 0);
    for (;;) {
      const double z = wanted_C.z() * (1 + kDistance * N());
      const Vec3 centre_C =
          z / wanted_C.z() * wanted_C + z * kPlace * c_.width / c_.camera.fx * Vec3(N(), N(), 0);
      const Mat3 R = RotationFromVector(kTurn_rad * Vec3(N(), N(), N())) * X_CK.R;
      if (const auto view = Hold(R, centre_C)) return *view;
    }
  }

 private:
  static constexpr double kDistance = 0.06, kPlace = 0.03, kTurn_rad = 0.1;

  double N() { return std::normal_distribution<double>(0, 1)(random_); }
  double Uniform(double low, double high) { return lens_captures::Uniform(random_, low, high); }
  double U() { return Uniform(-1, 1); }

  /// @return  nullopt if the board is not wholly in the image
  std::optional<vision::BoardView> Hold(const Mat3& R, const Vec3& centre_C) {
    vision::BoardView view;
    constexpr double kMargin_px = 6;
    CameraModel camera = c_.camera;
    if (c_.change_camera) c_.change_camera(views_, camera);
    for (int k = 0; k < c_.board.corners(); ++k) {
      const lens::Vec2 xy = c_.board.Corner(k) - c_.board.Centre();
      const Vec3 p_K(
          xy.x(), xy.y(),
          bow_.x() * xy.x() * xy.x() + bow_.y() * xy.y() * xy.y() + bow_.z() * xy.x() * xy.y());
      const Vec3 bent_K = c_.deform ? c_.deform(views_, p_K) : p_K;
      const Vec3 p_C = R * (bent_K + print_[static_cast<std::size_t>(k)]) + centre_C;
      const lens::Vec2 pixel = camera.PixelOfPoint(p_C);
      if (!(pixel.x() > kMargin_px && pixel.y() > kMargin_px && pixel.x() < c_.width - kMargin_px &&
            pixel.y() < c_.height - kMargin_px))
        return std::nullopt;
      view.corners_px.emplace_back(pixel + c_.noise_px * lens::Vec2(N(), N()));
      view.seen.push_back(true);
    }
    view.blur_px = 0.9;
    return view;
  }

  const Conditions& c_;
  Random& random_;
  int views_ = 0;
  const Vec3 bow_;
  std::vector<Vec3> print_;
};

}  // namespace plumbline::lens_captures
