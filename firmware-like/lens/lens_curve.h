// The lens between calibrated zooms, with an uncertainty that is earned.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "firmware-like/lens/known_lens.h"

namespace plumbline {

LensVector VectorOfLens(const Lens& lens);
Lens LensOfVector(const LensVector& values);

/// Derivatives at the nodes of the monotone piecewise cubic through (x, y), x ascending, 1 node or
/// more:
///   d_i = 0 where the slopes left and right differ in sign, else
///   d_i = (w1 + w2) / (w1 / m_left + w2 / m_right),
///   w1 = 2 h_right + h_left,  w2 = h_right + 2 h_left
/// and one-sided three-point slopes at the ends, cut to keep the shape.
/// [F. N. Fritsch and R. E. Carlson, SIAM J. Numer. Anal. 17 (1980) 238; F. N. Fritsch and J.
/// Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300]
std::vector<double> MonotoneSlopes(const std::vector<double>& x, const std::vector<double>& y);

/// Value and derivative at `at` of the cubic between (x0, y0, d0) and (x1, y1, d1).
struct CubicValue {
  double value = 0, slope = 0;
};
CubicValue CubicAt(double x0, double x1, double y0, double y1, double d0, double d1, double at);

/// A calibrated zoom. All nodes of a curve belong to one camera, mode and focus.
struct LensNode {
  std::int32_t zoom_counts = 0;
  Lens lens;  ///< focal lengths positive
  LensCovariance covariance = LensCovariance::Zero();
};

struct LensOnCurve {
  Lens lens;
  LensCovariance covariance = LensCovariance::Zero();  ///< of nodes and of interpolating
  double log_focal_sd = 0;                             ///< of ln fx (1), the same two parts
  double log_focal_per_count = 0;                      ///< d ln fx / d count
};

/// Monotone cubics over zoom counts of ln fx, ln fy and, as they are, of the other parameters.
///
/// Uncertainty: each inner node is left out and predicted from the others. The error e met there,
/// over the gap G of the two intervals beside it, stands for an error
///   e (w / G)^2 4 t (1 - t)
/// at the fraction t of an interval of width w beside it: second order, the worst that the cubic
/// does where a slope is cut. Widths are measured by how far ln f goes, and a tenth evenly over
/// the counts. An interval takes the largest of its own two nodes and half of the largest of all;
/// an outermost one, whose slope at the end is one-sided, kEndFactor of it. Fewer than four nodes
/// show too little of themselves: there the error of ln f is at least kUnseenOfTwo (..Three) of
/// its range over the nodes, that of the others their range. To this the covariance of the two
/// nodes is added, (1 - t) of one and t of the other.
///
/// Over made-up zooms of 6x to 30x two deviations hold 95 % or more of the errors of ln f with 2 to
/// 21 nodes; the claim is 1.4 to 4 times the error.
/// Valid between the outermost nodes; nothing is said beyond them.
class LensCurve {
 public:
  static constexpr double kUnseenOfTwo = 0.3, kUnseenOfThree = 0.06, kEndFactor = 3;

  /// Nodes in any order; of several at the same counts the last one counts. Nodes that are not
  /// finite or have no positive focal length are passed over.
  explicit LensCurve(std::vector<LensNode> nodes);

  const std::vector<LensNode>& nodes() const { return nodes_; }
  std::optional<LensOnCurve> At(double zoom_counts) const;

  /// Zooms that are worth calibrating next, the most useful first: first the ends of the range,
  /// where no node is near, then where the interpolation is most uncertain in focal length, each
  /// time as if the former ones had been calibrated; at the middle in ln f of its interval. Ends
  /// where the deviation is below `good_enough` (1) everywhere.
  std::vector<std::int32_t> Propose(std::int32_t lowest, std::int32_t highest, int count,
                                    double good_enough) const;

 private:
  std::size_t IntervalOf(double zoom_counts) const;
  LensVector Interpolated(double zoom_counts) const;
  void FindInterpolationError();

  std::vector<LensNode> nodes_;             ///< ascending, all counts different
  std::vector<double> x_;                   ///< their counts
  std::vector<std::vector<double>> y_, d_;  ///< by parameter: values (ln f), slopes
  std::vector<LensVector> error_;           ///< by interval: at its middle, of the values
};

}  // namespace plumbline
