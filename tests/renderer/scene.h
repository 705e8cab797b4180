// Ground-truth renderer of flat printed targets seen through a zoom lens with known intrinsics.
// Shares no code with the product.
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

  bool operator==(const Camera&) const = default;
};

/// Pixel of a point in the camera frame (z forward, x right, y down).
Eigen::Vector2d PixelOf(const Camera& camera, const Eigen::Vector3d& point_C);

/// A camera without distortion whose optical axis meets the centre of the image.
/// @param f  focal length [px]
Camera Pinhole(int width, int height, double f);

/// A zoom lens whose principal point shifts and whose distortion changes from barrel to pincushion
/// as it zooms in.
/// @param f  focal length [px], 1000 to 12,000
Camera ZoomLens(double f);

/// Reflectance (0 black .. 1 white) of a printed sheet at (x, y) [m] of its own plane, or a
/// negative number outside the sheet.
using Print = std::function<double(double x, double y)>;

/// A chessboard of `columns` x `rows` inner corners, the first of them at the origin, x to the
/// right, y downwards, with a white margin of one square.
Print Chessboard(int columns, int rows, double square_m);

/// A square tag of `cells` x `cells` cells with its centre at the origin and a white margin of one
/// cell.
/// @param white  the cells row by row from the top left
Print SquareTag(int cells, const std::vector<bool>& white, double side_m);

/// A chessboard as above with a square tag in the centre of each white square.
/// @param tags         cells of each tag, for the white squares row by row from the top left
/// @param white_first  the top left square is white
Print Charuco(int columns, int rows, double square_m, double tag_m, int cells,
              const std::vector<std::vector<bool>>& tags, bool white_first);

/// A symmetric grid of black discs, the first at the origin.
Print Circles(int columns, int rows, double spacing_m, double diameter_m);

/// Asymmetric grid of black discs: discs of a row are two steps apart, rows one step apart, and
/// every other row is shifted right by one step. The first disc is at the origin.
Print ShiftedCircles(int columns, int rows, double step_m, double diameter_m);

/// A print in the plane z = 0 of its own frame K, optionally bent; u, v are measured from its
/// centre.
struct Sheet {
  Print print;
  Eigen::Isometry3d X_CK = Eigen::Isometry3d::Identity();
  double half_width_m = 0.2, half_height_m = 0.2;  ///< of the printed area, about its centre
  double centre_x_m = 0, centre_y_m = 0;
  double bow_x = 0, bow_y = 0, bow_xy = 0;  ///< z = bow_x u^2 + bow_y v^2 + bow_xy u v [1/m]
};

/// Point of the bent sheet at (x, y), in frame K.
Eigen::Vector3d SheetPoint(const Sheet& sheet, double x, double y);

/// Image degradation by camera and lighting. Grey levels 0..255.
struct Conditions {
  double black = 30, white = 210;   ///< grey levels of black and white print
  double background = 110;          ///< grey level outside all sheets
  double blur_px = 0.8;             ///< Gaussian, standard deviation
  double noise = 3;                 ///< standard deviation of each pixel [grey levels]
  double shade_x = 0, shade_y = 0;  ///< relative change of the light from edge to edge
  double flicker = 0;               ///< relative amplitude of the light's ripple over the rows
  double flicker_rows = 400;        ///< period of the ripple [rows]
  double clutter = 0;               ///< amplitude of a random background [grey levels]
};

struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> grey;  ///< row by row, no padding
};

/// Renders the sheets, later ones over earlier ones. A pixel is the mean of the print over its
/// area, from 8 x 8 samples if an edge may cross it.
/// @param motion_C  rigid motion of the sheets during the exposure, in the camera frame from its
///                  start to its end; identity: no motion
Image Render(const Camera& camera, const std::vector<Sheet>& sheets, const Conditions& conditions,
             std::uint64_t seed, const Eigen::Isometry3d& motion_C = Eigen::Isometry3d::Identity());

}  // namespace plumbline::renderer
