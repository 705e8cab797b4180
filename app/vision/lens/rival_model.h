// Projection model of a calibration board with the effects that spoil a lens calibration.
#pragma once

#include <vector>

#include "app/vision/lens/lens_model.h"
#include "firmware-like/image/image_size.h"

namespace plumbline::vision {

/// Number of smooth functions over the board: products of cosines up to degree 5 (heights) and 4
/// (print).
inline constexpr int kHeightTerms = 18, kPrintTerms = 12;
/// Largest number of points of a board whose positions are estimated.
inline constexpr int kMaxFreePoints = 66;

/// Parameters beyond SharedVector; if all are zero, lens and board are those of BoardPixels().
enum Extra : int {
  kZoom,  ///< d ln f
  kShiftX,
  kShiftY,  ///< of the principal point [px]
  kBendX,
  kBendY,
  kBendXY,  ///< added to the bow [1/m]
  kVelocityX,
  kVelocityY,
  kVelocityZ,  ///< of the board during the read-out of the image [m]
  kSpinX,
  kSpinY,
  kSpinZ,    ///< likewise, about the board's centre, camera frame [rad]
  kStretch,  ///< of the print along its rows (1)
  kSkew,     ///< shear of the print (1)
  kPaneX,
  kPaneY,
  kPaneZ,       ///< glass before the lens: normal times thickness [m]
  kBoardGlass,  ///< thickness of the glass on the board [m]
  kK4,
  kK5,
  kK6,  ///< denominator of the rational model; of a fisheye only kK4 (1)
  kPrism1,
  kPrism2,
  kPrism3,
  kPrism4,  ///< s1..s4 of OpenCV's thin prism (1)
  kOffsetX,
  kOffsetY,
  kOffsetZ,  ///< of all board points [m]: for derivatives only, since the pose has the same effect
  kHeight,   ///< first of kHeightTerms [m]
  kPrintX = kHeight + kHeightTerms,  ///< first of kPrintTerms [m]
  kPrintY = kPrintX + kPrintTerms,
  kFree = kPrintY + kPrintTerms,  ///< first of the points' displacements: x, y, z of each [m]
  kExtraCount = kFree + 3 * kMaxFreePoints
};
using ExtraVector = Eigen::Matrix<double, kExtraCount, 1>;

/// Board points with the values of the smooth functions, prepared once for a fit.
class RivalBoard {
 public:
  /// @param corners  the board's points to be used
  RivalBoard(const target::Board& board, std::vector<std::size_t> corners);

  struct Point {
    std::size_t corner = 0;
    lens::Vec2 xy, uv;  ///< from the first corner and from the centre [m]
    Eigen::Matrix<double, kHeightTerms, 1> height;
    Eigen::Matrix<double, kPrintTerms, 1> print;
  };
  const std::vector<Point>& points() const { return points_; }
  const lens::Vec2& centre() const { return centre_; }
  double half_m() const { return half_m_; }  ///< half the board's diagonal

 private:
  std::vector<Point> points_;
  lens::Vec2 centre_;
  double half_m_;
};

/// Pixels of all points. Equations in the order of application:
///   (x, y) += stretch u, skew v, print(u, v);   z = bow + bend + height(u, v)
///   (x, y, z) += displacement of the point
///   p_C = R p_K + p + t (velocity + spin x (p_K - centre)),  t = row / height - 1/2
///   glass: parallel offset of the ray from Snell's law with an index of 1.5
///   lens: the five coefficients of Lens with a denominator 1 + k4 r^2 + k5 r^4 + k6 r^6 and thin
///   prism terms [OpenCV], or r = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8)
///   [J. Kannala and S. Brandt, PAMI 28 (2006) 1335]; then zoom and shift.
/// @param rows_px  measured row of each point: time of exposure with a rolling shutter
/// @return         false if a point is not in front of the camera
bool RivalPixels(const RivalBoard& board, image::ImageSize size, bool fisheye,
                 const SharedVector& shared, const ExtraVector& extra, const Pose& X_CK,
                 const std::vector<double>& rows_px, std::vector<lens::Vec2>& pixels);

/// Pixel of a direction in the camera frame according to the lens part of the model; d.z() > 0.
lens::Vec2 RivalPixelOf(bool fisheye, const SharedVector& shared, const ExtraVector& extra,
                        const Vec3& d);

/// The lens part of the model; zoom and shift do not count.
lens::Lens LensOfRival(bool fisheye, const SharedVector& shared, const ExtraVector& extra);

/// Plausible value of each extra parameter: standard deviation of its prior.
ExtraVector ExtraDeviations(const RivalBoard& board, image::ImageSize size);

}  // namespace plumbline::vision
