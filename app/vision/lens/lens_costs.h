// Cost functions of the lens fit: reprojection errors of each view, and the prior.
#pragma once

#include <ceres/ceres.h>

#include <vector>

#include "app/vision/lens/board_view.h"
#include "app/vision/lens/lens_fit.h"
#include "firmware-like/image/image_size.h"

namespace plumbline::vision {

/// State of one view during the fit.
struct ViewState {
  const BoardView* view = nullptr;
  Mat3 R_start = Mat3::Identity();
  Vec6 pose = Vec6::Zero();  ///< rotation vector applied after R_start, then p_CK
  std::vector<bool> used;
  std::vector<lens::Vec2> offsets;  ///< see DiscOffsets; zero for boards without discs [px]

  /// Measured image of the board's point k.
  lens::Vec2 Seen(std::size_t k) const { return view->corners_px[k] - offsets[k]; }
  Pose X_CK() const {
    const Vec3 w = pose.head<3>();
    const double angle = w.norm();
    const Mat3 turn =
        angle > 0 ? Eigen::AngleAxisd(angle, w / angle).toRotationMatrix() : Mat3(Mat3::Identity());
    return {R_start * turn, pose.tail<3>()};
  }
  void SetPose(const Pose& X_CK) {
    R_start = X_CK.R;
    pose << Vec3::Zero(), X_CK.p;
  }
};

int CountUsed(const ViewState& state);

/// Reprojection errors of the used corners of one view, in units of sigma_px.
class ViewCost : public ceres::CostFunction {
 public:
  ViewCost(const target::Board& board, const ViewState& state, double sigma_px);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  const target::Board& board_;
  const ViewState& state_;
  double sigma_px_;
};

/// Prior standard deviations in the parameters' own units, for a lens of focal length f [px].
SharedVector PriorDeviations(const LensPrior& prior, const target::Board& board,
                             image::ImageSize size, double f);

/// The prior as least-squares rows.
class PriorCost : public ceres::SizedCostFunction<kSharedCount, kSharedCount> {
 public:
  PriorCost(const SharedVector& sd, image::ImageSize size);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;
  /// Its contribution to J^T J.
  SharedMatrix Information() const { return rows_.transpose() * rows_; }

 private:
  SharedMatrix rows_;
  SharedVector mean_;
};

}  // namespace plumbline::vision
