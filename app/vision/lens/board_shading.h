// Uneven brightness over a board's image: vignetting and uneven light.
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "app/vision/lens/board_corner_refinement.h"
#include "app/vision/lens/board_view.h"

namespace plumbline::vision {

/// Brightness of the white and the black print over the board's image, as polynomials of fourth
/// degree. A gradient a of the brightness [1/px] displaces every edge, and with it every corner,
/// towards the bright side by about a s^2 for an edge of width s: 0.03 px if the image darkens to a
/// tenth at its corners.
class BoardShading {
 public:
  /// Samples the squares around each corner.
  /// @param image  8-bit
  /// @param rim    free margin around the tags as a share of a step; 1/2 without tags
  BoardShading(const cv::Mat& image, const std::vector<LatticeSteps>& steps, const BoardView& view,
               double rim);

  /// Whether the gradient is large enough to displace corners noticeably, and was determined.
  bool significant() const { return significant_; }
  /// Makes white and black print equally bright everywhere: (I - black) / (white - black).
  /// @param part    32-bit floating point
  /// @param origin  of `part` in the image [px]
  void Flatten(cv::Mat& part, const lens::Vec2& origin) const;

 private:
  static constexpr int kTerms = 15;
  using Polynomial = Eigen::Matrix<double, kTerms, 1>;
  Polynomial TermsAt(const lens::Vec2& pixel) const;
  lens::Vec2 WhiteAndBlackAt(const lens::Vec2& pixel) const;
  bool FitPolynomial(const std::vector<lens::Vec2>& at, const std::vector<double>& grey,
                     Polynomial& polynomial) const;
  bool HasGradient() const;

  lens::Vec2 middle_ = lens::Vec2::Zero(),
             half_ = lens::Vec2::Ones();  ///< of the sampled region [px]
  Polynomial white_ = Polynomial::Zero(), black_ = Polynomial::Zero();
  double contrast_ = 1;  ///< in the middle
  bool significant_ = false;
};

}  // namespace plumbline::vision
