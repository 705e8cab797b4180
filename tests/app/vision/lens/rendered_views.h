// Rendered views of a calibration board with ground truth, for tests and benchmarks.
#pragma once

#include <random>

#include "app/base/target/board.h"
#include "app/vision/lens/board_view.h"
#include "tests/app/rendered_image.h"
#include "tests/app/vision/tracking/tag_scene.h"
#include "tests/renderer/scene.h"

namespace plumbline::vision {

/// Conditions of a simulated capture.
struct Capture {
  enum class Kind { kVaried, kBurst, kSame } kind = Kind::kVaried;
  double f = 1700;
  int views = 20;
  double bow = 0;        ///< curvature of the board [1/m], at most, along each axis
  double creep = 0;      ///< share by which f grows from the first to the last view
  double step = 0;       ///< share by which f jumps
  double step_at = 0.5;  ///< share of the views before that
  double shift_px = 0;   ///< of the principal point, likewise
};

/// A rendered board and its pose.
struct DrawnView {
  renderer::Camera camera;
  renderer::Sheet sheet;
};

/// The pattern of a board. @param white_first  for ChArUco: the top left square is white
inline renderer::Print PrintOf(const target::Board& board, bool white_first = false) {
  switch (board.kind) {
    case target::BoardKind::kChessboard:
      break;
    case target::BoardKind::kCharuco: {
      const target::TagFamily family = target::TagFamilyOfName(board.family).value();
      std::vector<std::vector<bool>> tags;
      for (int id = 0; 2 * id <= (board.columns + 1) * (board.rows + 1); ++id)
        tags.push_back(test::CellsOf(family, id));
      return renderer::Charuco(board.columns, board.rows, board.square_m, board.marker_m,
                               family.cells(), tags, white_first);
    }
    case target::BoardKind::kCircles:
      return renderer::Circles(board.columns, board.rows, board.square_m, board.marker_m);
    case target::BoardKind::kAsymmetricCircles:
      return renderer::ShiftedCircles(board.columns, board.rows, board.square_m, board.marker_m);
  }
  return renderer::Chessboard(board.columns, board.rows, board.square_m);
}

/// True image positions of the corners.
inline std::vector<lens::Vec2> TrueCorners(const DrawnView& view, const target::Board& board) {
  std::vector<lens::Vec2> pixels;
  for (int k = 0; k < board.corners(); ++k) {
    const lens::Vec2 c = board.Corner(k);
    pixels.push_back(renderer::PixelOf(
        view.camera, view.sheet.X_CK * renderer::SheetPoint(view.sheet, c.x(), c.y())));
  }
  return pixels;
}

/// Samples poses until `views` of them show the whole board.
inline std::vector<DrawnView> DrawViews(const Capture& capture, const target::Board& board,
                                        std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> U(-1, 1);
  std::normal_distribution<double> N(0, 1);
  const renderer::Camera lens = renderer::ZoomLens(capture.f);
  const lens::Vec2 centre = board.Centre();
  const double width = 2 * centre.x() + 2 * board.square_m;
  const double near = capture.f * width / 1000;  // there the board is 1000 px wide
  const auto turned = [](double x, double y, double z) {
    return (Eigen::AngleAxisd(x, Eigen::Vector3d::UnitX()) *
            Eigen::AngleAxisd(y, Eigen::Vector3d::UnitY()) *
            Eigen::AngleAxisd(z, Eigen::Vector3d::UnitZ()))
        .toRotationMatrix();
  };
  const Eigen::Matrix3d R0 = turned(0.35 * U(random), 0.35 * U(random), 0.2 * U(random));
  const Eigen::Vector3d drift(0.1 * U(random), 0.1 * U(random), 0.1 * U(random));
  const Eigen::Vector3d sway(0.3 * U(random), 0.3 * U(random), 0.3 * U(random));
  const double bow_x = capture.bow * U(random), bow_y = capture.bow * U(random);
  const double bow_xy = capture.bow * U(random);
  const renderer::Print print = PrintOf(board);
  std::vector<DrawnView> views;
  for (int trial = 0; trial < 5000 && static_cast<int>(views.size()) < capture.views; ++trial) {
    const double when =
        capture.views > 1 ? static_cast<double>(views.size()) / (capture.views - 1) - 0.5 : 0;
    Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
    if (capture.kind == Capture::Kind::kVaried) {
      X.linear() = turned(0.65 * U(random), 0.65 * U(random), 0.5 * U(random));
      const double z = near * (1.15 + 0.4 * U(random));
      X.translation() = Eigen::Vector3d(0.5 * U(random) * z * 1920 / capture.f,
                                        0.5 * U(random) * z * 1080 / capture.f, z);
    } else {
      const double part = capture.kind == Capture::Kind::kBurst ? when : 0;
      const double shake = capture.kind == Capture::Kind::kBurst ? 0.02 : 0.0005;
      X.linear() =
          R0 * turned(part * sway.x() + shake * N(random), part * sway.y() + shake * N(random),
                      part * sway.z() + shake * N(random));
      X.translation() = Eigen::Vector3d(0, 0, 1.1 * near) + part * near * drift;
    }
    X = X * Eigen::Translation3d(-centre.x(), -centre.y(), 0);
    DrawnView view{lens, {}};
    const bool after = when > capture.step_at - 0.5;
    const double grown = 1 + capture.creep * when + (after ? capture.step : 0);
    view.camera.fx *= grown;
    view.camera.fy *= grown;
    if (after) view.camera.cx += capture.shift_px;
    view.sheet.print = print;
    view.sheet.X_CK = X;
    view.sheet.centre_x_m = centre.x();
    view.sheet.centre_y_m = centre.y();
    view.sheet.half_width_m = centre.x() + 2.5 * board.square_m;
    view.sheet.half_height_m = centre.y() + 2.5 * board.square_m;
    view.sheet.bow_x = bow_x;
    view.sheet.bow_y = bow_y;
    view.sheet.bow_xy = bow_xy;
    bool inside = true;
    for (const lens::Vec2& p : TrueCorners(view, board)) {
      inside &= p.x() > 12 && p.y() > 12 && p.x() < lens.width - 13 && p.y() < lens.height - 13;
    }
    if (inside || capture.kind != Capture::Kind::kVaried) views.push_back(view);
  }
  return views;
}

/// Simulated detections with Gaussian noise, without rendering.
inline std::vector<BoardView> NoisyViews(const std::vector<DrawnView>& drawn,
                                         const target::Board& board, double noise_px,
                                         std::uint64_t seed) {
  std::mt19937_64 random(seed + 1000);
  std::normal_distribution<double> N(0, noise_px);
  std::vector<BoardView> views;
  for (const DrawnView& one : drawn) {
    BoardView view;
    view.name = "view " + std::to_string(views.size());
    view.time_s = static_cast<double>(views.size());
    view.blur_px = 1;
    for (const lens::Vec2& p : TrueCorners(one, board)) {
      view.corners_px.emplace_back(p + lens::Vec2(N(random), N(random)));
      view.seen.push_back(p.x() > 0 && p.y() > 0 && p.x() < one.camera.width - 1 &&
                          p.y() < one.camera.height - 1);
    }
    views.push_back(view);
  }
  return views;
}

}  // namespace plumbline::vision
