// What the fit of a lens minimises: each view's corners, and the prior.
#pragma once

#include <ceres/ceres.h>

#include <vector>

#include "app/lens/lens_fit.h"

namespace plumbline {

/// One view's place in the fit.
struct PlacedView {
  const BoardView* view = nullptr;
  Mat3 R_start = Mat3::Identity();
  Vec6 pose = Vec6::Zero();  ///< rotation vector after R_start, then p_CK
  std::vector<bool> used;
  std::vector<Vec2> offsets;  ///< of what is seen from the images of the board's points [px]

  Vec2 Seen(std::size_t k) const { return view->corners_px[k] - offsets[k]; }
  Pose X_CK() const {
    const Vec3 w = pose.head<3>();
    const double angle = w.norm();
    const Mat3 turn =
        angle > 0 ? Eigen::AngleAxisd(angle, w / angle).toRotationMatrix() : Mat3(Mat3::Identity());
    return {R_start * turn, pose.tail<3>()};
  }
  void Place(const Pose& X_CK) {
    R_start = X_CK.R;
    pose << Vec3::Zero(), X_CK.p;
  }
};

int CornersUsed(const PlacedView& placed);

/// Residuals of one view, corners not used left out.
class ViewCost : public ceres::CostFunction {
 public:
  ViewCost(const Board& board, const PlacedView& placed, double sigma_px);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  const Board& board_;
  const PlacedView& placed_;
  double sigma_px_;
};

/// Standard deviations of the prior in the parameters' own units, for a lens of focal length f.
SharedVector PriorDeviations(const LensPrior& prior, const Board& board, ImageSize size, double f);

/// The prior as rows of least squares: what is added to J^T J, and a cost for Ceres.
class PriorCost : public ceres::SizedCostFunction<kSharedCount, kSharedCount> {
 public:
  PriorCost(const SharedVector& sd, ImageSize size);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;
  SharedMatrix Information() const { return rows_.transpose() * rows_; }

 private:
  SharedMatrix rows_;
  SharedVector mean_;
};

}  // namespace plumbline
