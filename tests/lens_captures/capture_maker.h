// Simulated captures of a calibration board that go wrong in a known way.
#pragma once

#include <functional>
#include <random>
#include <string>
#include <vector>

#include "app/base/target/board.h"
#include "app/vision/lens/board_view.h"
#include "firmware-like/image/image_size.h"
#include "tests/lens_captures/camera_model.h"

namespace plumbline::lens_captures {

using Random = std::mt19937_64;
inline double Uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
/// A magnitude in the range, with either sign.
inline double EitherSign(Random& random, double low, double high) {
  const double size = Uniform(random, low, high);
  return Uniform(random, -1, 1) < 0 ? -size : size;
}

/// Conditions of one capture. Times run from 0 at the first view to 1 at the last.
struct Conditions {
  int width = 1920, height = 1080;
  CameraModel camera;  ///< at the end of the capture: the truth
  target::Board board;
  int views = 20;
  double noise_px = 0.04;
  double max_tilt_rad = 0.65, max_roll_rad = 0.5;
  double spread = 0.5;           ///< of the board's centre over the image, share of its size
  double nearest = 0.75;         ///< distance in units of that at which the board fills 1/2 width
  Vector3d velocity_m{0, 0, 0};  ///< of the board, per read-out of the sensor
  bool last_head_on = false;     ///< the last view is not tilted
  double print_noise_m = 5e-6;   ///< of each corner, the same in all views
  double bow_per_m = 0;          ///< curvature, at most, along each axis

  /// Changes of the camera in view j, of the board's point (x, y) from its centre in view j, of the
  /// velocities in view j, and of the finished views. Empty: none.
  std::function<void(int j, CameraModel&)> change_camera;
  std::function<Vector3d(int j, const Vector3d&)> deform;
  std::function<Vector3d(int j)> velocity_of;  ///< [m per read-out]
  std::function<Vector3d(int j)> spin_of;      ///< [rad per read-out]
  std::function<void(std::vector<vision::BoardView>&)> change_views;
  Plate board_glass;  ///< lies on the board
};

/// A good capture: image size, lens, board, number of views and noise are random.
Conditions GoodConditions(Random& random);

struct SimulatedCapture {
  Conditions conditions;
  std::vector<vision::BoardView> views;
  std::vector<Eigen::Isometry3d> X_CK;  ///< of the board's centre, per view
};
SimulatedCapture Simulate(const Conditions& conditions, Random& random);

/// The same capture as rendered images in which the board is detected.
/// @param degrade  changes the image of view j, or the renderer's conditions before it is rendered
struct Photo {
  int width, height;
  std::vector<std::uint8_t> grey;
};
struct PhotoHooks {
  std::function<void(int j, double& blur_px, double& noise)> before;
  std::function<void(int j, Photo&, Random&)> after;  ///< noise is added after it
};
/// @return  the views found; conditions without change of camera, deformation or motion
std::vector<vision::BoardView> Photograph(const SimulatedCapture& capture, const PhotoHooks& hooks,
                                          Random& random);

/// A kind of capture.
struct Kind {
  std::string name;
  enum class Expected { kGood, kBad, kEither } expected = Expected::kBad;
  /// Words of which a reason must contain one to name the cause; separated by '|'.
  std::string words;
  std::function<void(Conditions&, Random&)> prepare;
  PhotoHooks photo = {};
  bool rendered = false;  ///< as images
};
std::vector<Kind> AllKinds();

}  // namespace plumbline::lens_captures
