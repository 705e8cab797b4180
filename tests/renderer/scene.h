// A renderer of truth: flat printed targets seen through a zoom lens, with exact intrinsics.
// It shares no code with the product; it knows nothing of detection or solving.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <vector>

namespace plumbline::renderer {

/// A camera: pixel (0, 0) is the centre of the top-left pixel; distortion k1, k2, p1, p2, k3.
struct Camera {
  int width = 1920, height = 1080;
  double fx = 1700, fy = 1700, cx = 959.5, cy = 539.5;
  double distortion[5] = {0, 0, 0, 0, 0};
};

/// Pixel of a point in the camera frame (z forward, x right, y down).
Eigen::Vector2d PixelOf(const Camera& camera, const Eigen::Vector3d& point_C);

/// A zoom lens whose principal point wanders and whose barrel turns to pincushion as it zooms in.
/// @param f  focal length [px], 1000 to 12,000
Camera ZoomLens(double f);

/// Reflectance (0 black .. 1 white) of a printed sheet at (x, y) [m] of its own plane, or a
/// negative number outside the sheet.
using Print = std::function<double(double x, double y)>;

/// A chessboard of `columns` x `rows` inner corners, the first of them at the origin, x to the
/// right, y downwards, with a white margin of one square.
Print Chessboard(int columns, int rows, double square_m);

/// A square tag of `cells` x `cells` cells with its centre at the origin; bit (r, c) of `bits` row
/// by row from the most significant, 1 white; with a white margin of one cell.
Print SquareTag(int cells, const std::vector<bool>& white, double side_m);

/// A chessboard like the above with a square tag in the middle of each white square, row by row
/// from the top left; `tags` holds the cells of each. @param white_first  the top left square is
/// white
Print Charuco(int columns, int rows, double square_m, double tag_m, int cells,
              const std::vector<std::vector<bool>>& tags, bool white_first);

/// A symmetric grid of black discs, the first at the origin.
Print Circles(int columns, int rows, double spacing_m, double diameter_m);

/// Rows of black discs that lie two steps apart, every other row shifted by one to the right; rows
/// lie one step apart. The first disc is at the origin.
Print ShiftedCircles(int columns, int rows, double step_m, double diameter_m);

/// A print lying in the plane z = 0 of its own frame K, bent to z = bow x^2 + bow_y y^2 [1/m]
/// about (x0, y0).
struct Sheet {
  Print print;
  Eigen::Isometry3d X_CK = Eigen::Isometry3d::Identity();
  double half_width_m = 0.2, half_height_m = 0.2;  ///< of what is printed, about (centre_x, ..)
  double centre_x_m = 0, centre_y_m = 0;
  double bow_x = 0, bow_y = 0, bow_xy = 0;  ///< z = bow_x u^2 + bow_y v^2 + bow_xy u v
};

/// The point of the sheet at (x, y) in the frame K, with its bow.
Eigen::Vector3d SheetPoint(const Sheet& sheet, double x, double y);

/// How the camera and the light degrade the image. Grey levels 0..255.
struct Conditions {
  double black = 30, white = 210;   ///< grey levels of black and white print
  double background = 110;          ///< grey level where there is no sheet
  double blur_px = 0.8;             ///< Gaussian, standard deviation
  double noise = 3;                 ///< standard deviation of each pixel [grey levels]
  double shade_x = 0, shade_y = 0;  ///< the light changes by this share from edge to edge
  double flicker = 0;               ///< amplitude of the light's ripple over the rows (1)
  double flicker_rows = 400;        ///< rows in one period of it
  double clutter = 0;               ///< amplitude of a random background [grey levels]
};

struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> grey;  ///< row by row, no padding
};

/// Renders the sheets, later ones over earlier ones. A pixel is the mean of the print over its
/// area: 8 x 8 samples wherever an edge may cross it.
/// @param motion_C  each sheet's movement during the exposure, as a rigid motion in the camera
///                  frame from its start to its end; identity for none
Image Render(const Camera& camera, const std::vector<Sheet>& sheets, const Conditions& conditions,
             std::uint64_t seed, const Eigen::Isometry3d& motion_C = Eigen::Isometry3d::Identity());

}  // namespace plumbline::renderer
