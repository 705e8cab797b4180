// Least-squares fit of a lens together with one effect that may have spoilt the capture.
#pragma once

#include <span>
#include <vector>

#include "app/vision/lens/board_view.h"
#include "app/vision/lens/lens_fit.h"
#include "app/vision/lens/lens_model.h"
#include "firmware-like/image/image_size.h"
#include "firmware-like/statistics/group_equations.h"

namespace plumbline::vision {

// Projection model of a calibration board with the effects that spoil a lens calibration.

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

/// One explanation of the residuals: which extra parameters are estimated, and how they vary.
struct Rival {
  std::vector<int> global;     ///< of Extra, equal in all views
  std::vector<int> local;      ///< of Extra, different in each view
  std::vector<int> changing;   ///< of Extra, times `course`
  std::vector<double> course;  ///< weight of each view; 0 for the last one
  bool fisheye = false;
  bool free_aspect = false;  ///< fx / fy is estimated instead of almost 1
};

struct RivalResult {
  bool converged = false;
  SharedVector shared = SharedVector::Zero();  ///< at the time of the last view
  ExtraVector extra = ExtraVector::Zero();     ///< global and changing
  std::vector<ExtraVector> local;              ///< per view
  std::vector<Pose> X_CK;
  double square_sum_px2 = 0;  ///< of the residuals of the used corners
  double prior_chi2 = 0;
  int observations = 0, parameters = 0;  ///< parameters beyond those of every fit
};

/// Precision of the lens of a fit whose parameters are equal in all views.
struct RivalPrecision {
  /// Of the lens parameters, for independent corner errors as large as the noise; the board's
  /// shape, the print and the poses are eliminated.
  lens::LensCovariance covariance = lens::LensCovariance::Zero();
  /// Factor on the covariance: the larger of the variance of the residuals, of their variance in
  /// the directions of the parameters, and of the part common to all views, in units of the noise.
  double dispersion = 1;
  double noise_px = 0;              ///< for which the covariance is stated
  double sigma_px = 0;              ///< of a corner's coordinate, from the residuals
  std::vector<double> view_rms_px;  ///< per coordinate
};

/// Result of one linear step from a fit for a rival whose parameters are added to those of the fit.
struct ScoreTest {
  Rival rival;  ///< with the parameters of the fit
  /// Decrease of the sum of squares, in units of noise_px^2, less the cost of the priors.
  double decrease = 0;
  /// ln det(D S D) / 2, with S the information on the extra parameters, the others eliminated, and
  /// D their prior deviations: what a rival loses in evidence because most of the values that it
  /// might have had do not fit [D. MacKay, Neural Comput. 4 (1992) 415]. Only of global parameters.
  double occam = 0;
  /// The fit after the step, without the views; only of global parameters.
  RivalResult result;
  /// Of the lens parameters with the rival's, for corner errors as large as the noise.
  lens::LensCovariance covariance = lens::LensCovariance::Zero();
  /// Of the last local parameter, if there is one: standard deviation in one view for such errors,
  /// the median; and variance of its values in units of that. A view with wrong corners counts as
  /// at most three standard deviations.
  double local_deviation = 0, local_square = 0;
  /// Variance of the residuals of the fit in units of noise_px^2: the median over the views.
  double view_dispersion = 0;
  /// Of the added global parameters: variance of their scores over the views about the step, in
  /// units of what independent corner errors of noise_px make. Correlated residuals make it larger
  /// than the variance of the residuals; the effect itself does not. A lower limit.
  double score_dispersion = 0;
  /// Of a rival with local parameters: variance of the residuals, after those are fitted, in the
  /// directions in which the shared parameters would change the view, in units of noise_px^2,
  /// likewise.
  double smooth_dispersion = 0;
};

/// The lens parameters' part of a covariance of the common parameters, which are SharedVector and
/// then the global parameters of the rival.
lens::LensCovariance LensCovarianceIn(const Rival& rival, const Eigen::MatrixXd& covariance);

/// The views of one capture, prepared for the fits of several rivals.
class RivalProblem {
 public:
  /// @param fit       start
  /// @param used      corners to use, per view; a board with many of them is thinned out
  /// @param noise_px  standard deviation of a corner's coordinate: scale of the priors
  /// @param oblong_pixels  fx / fy is estimated by every rival
  RivalProblem(const target::Board& board, std::span<const BoardView> views, image::ImageSize size,
               const LensFit& fit, const std::vector<std::vector<bool>>& used, double noise_px,
               bool oblong_pixels = false);

  /// Levenberg and Marquardt with numerical derivatives; the poses and local parameters are
  /// eliminated view by view.
  RivalResult Fit(const Rival& rival) const;
  /// The same from another start. @param start  `converged` is not needed
  RivalResult Fit(const Rival& rival, RivalResult start) const;
  /// Information and score of each view about a fit, with the extra parameters held, and the
  /// residuals of the board's points that take part, as far as they are seen; of the result, what
  /// describes the precision of the corners is not set.
  LensFit Linearized(const Rival& rival, const RivalResult& at) const;
  /// How well a fit determines the lens, and what it leaves unexplained.
  RivalPrecision PrecisionOf(const Rival& rival, const RivalResult& at) const;
  /// One linear step for each rival from the fit of `base`; the weights of the views
  /// (Rival::course) are ignored. Empty if a point is not in front of the camera.
  std::vector<ScoreTest> ScoreTests(const std::vector<Rival>& rivals, const Rival& base,
                                    const RivalResult& at) const;
  const RivalBoard& board() const { return board_; }
  /// Standard deviations of the extra parameters' priors. A rational lens may have large ones.
  ExtraVector DeviationsOf(const Rival& rival) const;
  /// Largest distance of a corner used from the middle of the image [px].
  double SeenRadius() const;

 private:
  struct ViewData {
    std::vector<double> rows_px;
    std::vector<lens::Vec2> corners_px;
    std::vector<bool> seen, used;
  };
  /// Derivatives and residuals of one view.
  struct Blocks {
    Eigen::MatrixXd own, common;  ///< by pose and local, and by shared, global and changing
    Eigen::VectorXd residuals;
  };
  using OwnEquations = statistics::GroupEquations<Eigen::Dynamic, Eigen::Dynamic>;
  struct NormalEquations {
    Eigen::MatrixXd H;  ///< of the common parameters
    Eigen::VectorXd g;
    std::vector<OwnEquations> own;
  };
  /// Extra parameters of view j.
  static ExtraVector ExtraOf(const Rival& rival, const RivalResult& at, std::size_t j);
  /// @param step  rotation vector [rad] and translation [m], camera frame
  static Pose Moved(const Pose& X_CK, const Eigen::Ref<const Vec6>& step);
  bool Evaluate(const Rival& rival, const RivalResult& at, double& cost) const;
  bool Linearize(const Rival& rival, const RivalResult& at, std::vector<Blocks>& blocks) const;
  bool LinearizeExtras(std::size_t j, const Rival& rival, const RivalResult& at,
                       Blocks& block) const;
  static OwnEquations EquationsOf(const Blocks& block);
  void SetResiduals(std::size_t j, const Rival& rival, const RivalResult& at, LensFit& fit) const;
  NormalEquations NormalEquationsOf(const Rival& rival, const RivalResult& at,
                                    const std::vector<Blocks>& blocks) const;
  RivalResult Stepped(const Rival& rival, const RivalResult& at, const NormalEquations& normal,
                      double damping) const;
  bool ResidualsOf(std::size_t j, const Rival& rival, const SharedVector& shared,
                   const ExtraVector& extra, const Pose& X_CK, Eigen::VectorXd& residuals) const;
  SharedMatrix PriorInformation(const Rival& rival, const SharedVector& shared,
                                SharedVector& mean) const;
  double PriorCost(const Rival& rival, const RivalResult& at) const;

  image::ImageSize size_;
  target::Board declared_;
  RivalBoard board_;
  double noise_px_;
  std::vector<ViewData> views_;
  RivalResult start_;
  ExtraVector deviations_;
  bool oblong_pixels_;
};

}  // namespace plumbline::vision
