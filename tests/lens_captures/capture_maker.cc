#include "tests/lens_captures/capture_maker.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "app/vision/lens/board_detection.h"
#include "tests/renderer/scene.h"

namespace plumbline::lens_captures {
namespace {

Eigen::Matrix3d Turned(double x, double y, double z) {
  return (Eigen::AngleAxisd(x, Vector3d::UnitX()) * Eigen::AngleAxisd(y, Vector3d::UnitY()) *
          Eigen::AngleAxisd(z, Vector3d::UnitZ()))
      .toRotationMatrix();
}

/// Pixel of a board point whose board moves while the sensor is read row by row.
Vector2d PixelDuringReadOut(const CameraModel& camera, const Eigen::Isometry3d& X_CK,
                            const Vector3d& p_K, const Vector3d& velocity, const Vector3d& spin,
                            int height) {
  Vector2d pixel = camera.PixelOfPoint(X_CK * p_K);
  if (velocity.isZero() && spin.isZero()) return pixel;
  for (int pass = 0; pass < 8; ++pass) {
    const double when = pixel.y() / height - 0.5;
    const Vector3d turn = when * spin;
    const Eigen::Matrix3d R =
        turn.norm() > 0 ? Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix()
                        : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
    pixel = camera.PixelOfPoint(X_CK.linear() * (R * p_K) + X_CK.translation() + when * velocity);
  }
  return pixel;
}

/// Point as it appears through glass that lies on the board.
Vector3d ThroughBoardGlass(const Plate& glass, const Eigen::Isometry3d& X_CK, const Vector3d& p_K) {
  const Vector3d p_C = X_CK * p_K;
  if (glass.thickness_m == 0) return p_C;
  Plate plate = glass;
  plate.normal = X_CK.linear().col(2);
  Vector3d seen = p_C;
  for (int pass = 0; pass < 6; ++pass) seen = p_C - PlateOffset(plate, seen.normalized());
  return seen;
}

struct Frame {
  CameraModel camera;
  Eigen::Isometry3d X_CK;
  Vector3d velocity, spin;
};

vision::BoardView ViewOf(const Conditions& c, const Frame& frame, int j,
                         const std::vector<Vector3d>& print, const Vector3d& bow) {
  vision::BoardView view;
  const lens::Vec2 centre = c.board.Centre();
  for (int k = 0; k < c.board.corners(); ++k) {
    const lens::Vec2 xy = c.board.Corner(k) - centre;
    Vector3d point(
        xy.x(), xy.y(),
        bow.x() * xy.x() * xy.x() + bow.y() * xy.y() * xy.y() + bow.z() * xy.x() * xy.y());
    if (c.deform) point = c.deform(j, point);
    point += print[static_cast<std::size_t>(k)];
    const Vector3d seen = ThroughBoardGlass(c.board_glass, frame.X_CK, point);
    const Vector3d p_K = frame.X_CK.inverse() * seen;
    view.corners_px.emplace_back(
        PixelDuringReadOut(frame.camera, frame.X_CK, p_K, frame.velocity, frame.spin, c.height));
    view.seen.push_back(true);
  }
  view.blur_px = 0.9;
  return view;
}

bool Inside(const vision::BoardView& view, int width, int height) {
  constexpr double kMargin_px = 6;
  for (const lens::Vec2& p : view.corners_px) {
    if (!(p.x() > kMargin_px && p.y() > kMargin_px && p.x() < width - kMargin_px &&
          p.y() < height - kMargin_px))
      return false;
  }
  return true;
}

}  // namespace

Conditions GoodConditions(Random& random) {
  constexpr std::pair<int, int> kSizes[] = {{1920, 1080}, {1280, 720}, {1280, 960}, {640, 480}};
  constexpr std::pair<int, int> kBoards[] = {{17, 11}, {11, 8}, {9, 6}};
  Conditions c;
  std::tie(c.width, c.height) = kSizes[random() % 4];
  const double f = c.width * std::exp(Uniform(random, std::log(0.7), std::log(2.5)));
  c.camera.fx = f;
  c.camera.fy = f * (1 + Uniform(random, -2e-4, 2e-4));
  c.camera.cx = 0.5 * c.width - 0.5 + 0.015 * c.width * Uniform(random, -1, 1);
  c.camera.cy = 0.5 * c.height - 0.5 + 0.015 * c.width * Uniform(random, -1, 1);
  const double edge = 0.5 * std::hypot(c.width, c.height) / f;
  c.camera.k[0] = Uniform(random, -0.06, 0.02) / (edge * edge);
  c.camera.k[1] = Uniform(random, -0.005, 0.01) / std::pow(edge, 4);
  c.camera.p[0] = Uniform(random, -1, 1) * 4e-4;
  c.camera.p[1] = Uniform(random, -1, 1) * 4e-4;
  std::tie(c.board.columns, c.board.rows) = kBoards[random() % 3];
  c.board.square_m = 0.2 / c.board.columns;
  c.views = 20 + static_cast<int>(random() % 13);
  c.noise_px = std::exp(Uniform(random, std::log(0.02), std::log(0.06)));
  c.bow_per_m = 0.02;
  return c;
}

SimulatedCapture Simulate(const Conditions& c, Random& random) {
  std::normal_distribution<double> N(0, 1);
  SimulatedCapture capture{c, {}, {}};
  std::vector<Vector3d> print;
  for (int k = 0; k < c.board.corners(); ++k)
    print.emplace_back(c.print_noise_m * Vector3d(N(random), N(random), 0));
  const Vector3d bow = c.bow_per_m * Vector3d(Uniform(random, -1, 1), Uniform(random, -1, 1),
                                              Uniform(random, -1, 1));
  const double board_m = c.board.square_m * (c.board.columns + 1);
  const double half_width = c.camera.fx * board_m / (0.5 * c.width);  // the board fills half
  for (int trial = 0; trial < 20000 && static_cast<int>(capture.views.size()) < c.views; ++trial) {
    const int j = static_cast<int>(capture.views.size());
    Frame frame{c.camera, Eigen::Isometry3d::Identity(), c.velocity_m, Vector3d::Zero()};
    const double z = half_width * (c.nearest + 0.5 * Uniform(random, 0, 1));
    // The last frame is tilted, as the manual asks.
    const double least = j + 1 == c.views && !c.last_head_on ? 0.6 : 0;
    frame.X_CK.linear() = Turned(c.max_tilt_rad * EitherSign(random, least, 1),
                                 c.max_tilt_rad * EitherSign(random, least, 1),
                                 c.max_roll_rad * Uniform(random, -1, 1));
    // Every third view is held into a corner of the image, as far as the board stays inside.
    const bool cornered = c.spread > 0.4 && j % 3 == 0;
    const double x = cornered ? (j % 2 == 0 ? 1 : -1) : Uniform(random, -1, 1);
    const double y = cornered ? (j / 3 % 2 == 0 ? 1 : -1) : Uniform(random, -1, 1);
    const double reach = cornered ? Uniform(random, 0.1, 0.45) : c.spread;
    frame.X_CK.translation() =
        z * Vector3d(x * reach * c.width / c.camera.fx, y * reach * c.height / c.camera.fy, 1);
    if (j + 1 == c.views && c.last_head_on)
      frame.X_CK.linear() = Turned(0.03, -0.02, Uniform(random, -0.3, 0.3));
    if (c.change_camera) c.change_camera(j, frame.camera);
    if (c.velocity_of) frame.velocity = c.velocity_of(j);
    if (c.spin_of) frame.spin = c.spin_of(j);
    vision::BoardView view = ViewOf(c, frame, j, print, bow);
    if (!Inside(view, c.width, c.height)) continue;
    for (lens::Vec2& p : view.corners_px) p += c.noise_px * lens::Vec2(N(random), N(random));
    view.name = "view " + std::to_string(j + 1);
    view.time_s = j;
    capture.views.push_back(std::move(view));
    capture.X_CK.push_back(frame.X_CK);
  }
  if (c.change_views) c.change_views(capture.views);
  return capture;
}

std::vector<vision::BoardView> Photograph(const SimulatedCapture& capture, const PhotoHooks& hooks,
                                          Random& random) {
  const Conditions& c = capture.conditions;
  renderer::Camera camera;
  camera.width = c.width;
  camera.height = c.height;
  std::tie(camera.fx, camera.fy, camera.cx, camera.cy) =
      std::tuple(c.camera.fx, c.camera.fy, c.camera.cx, c.camera.cy);
  const double distortion[5] = {c.camera.k[0], c.camera.k[1], c.camera.p[0], c.camera.p[1],
                                c.camera.k[2]};
  std::copy(std::begin(distortion), std::end(distortion), camera.distortion);
  const lens::Vec2 centre = c.board.Centre();
  renderer::Sheet sheet;
  sheet.print = renderer::Chessboard(c.board.columns, c.board.rows, c.board.square_m);
  sheet.centre_x_m = centre.x();
  sheet.centre_y_m = centre.y();
  sheet.half_width_m = centre.x() + 2 * c.board.square_m;
  sheet.half_height_m = centre.y() + 2 * c.board.square_m;
  std::vector<vision::BoardView> views;
  for (std::size_t j = 0; j < capture.X_CK.size(); ++j) {
    renderer::Conditions light;
    double noise = light.noise;
    if (hooks.before) hooks.before(static_cast<int>(j), light.blur_px, noise);
    light.noise = 0;
    sheet.X_CK = capture.X_CK[j] * Eigen::Translation3d(-centre.x(), -centre.y(), 0);
    const renderer::Image image = renderer::Render(camera, {sheet}, light, random());
    Photo photo{image.width, image.height, image.grey};
    if (hooks.after) hooks.after(static_cast<int>(j), photo, random);
    std::normal_distribution<double> N(0, noise);
    for (std::uint8_t& grey : photo.grey)
      grey = static_cast<std::uint8_t>(std::clamp(grey + N(random), 0.0, 255.0));
    const auto view =
        vision::DetectBoard({photo.grey.data(), photo.width, photo.height, photo.width}, c.board);
    if (!view) continue;
    views.push_back(*view);
    views.back().name = "view " + std::to_string(j + 1);
    views.back().time_s = static_cast<double>(j);
  }
  return views;
}

}  // namespace plumbline::lens_captures
