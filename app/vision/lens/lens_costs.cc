#include "app/vision/lens/lens_costs.h"

#include <algorithm>
#include <cmath>

namespace plumbline::vision {

int CountUsed(const ViewState& state) {
  return static_cast<int>(std::ranges::count(state.used, true));
}

ViewCost::ViewCost(const target::Board& board, const ViewState& state, double sigma_px)
    : board_(board), state_(state), sigma_px_(sigma_px) {
  set_num_residuals(2 * CountUsed(state));
  mutable_parameter_block_sizes()->push_back(kSharedCount);
  mutable_parameter_block_sizes()->push_back(6);
}

bool ViewCost::Evaluate(double const* const* parameters, double* residuals,
                        double** jacobians) const {
  const Eigen::Map<const SharedVector> shared(parameters[0]);
  const Eigen::Map<const Vec6> pose(parameters[1]);
  const bool derive = jacobians != nullptr && (jacobians[0] != nullptr || jacobians[1] != nullptr);
  const std::size_t corners = static_cast<std::size_t>(board_.corners());
  std::vector<lens::Vec2> pixels;
  std::vector<double> by_shared(derive ? corners * 2 * kSharedCount : 0);
  std::vector<double> by_pose(derive ? corners * 12 : 0);
  if (!BoardPixels(board_, shared, state_.R_start, pose.head<3>(), pose.tail<3>(), pixels,
                   derive ? by_shared.data() : nullptr, by_pose.data()))
    return false;
  std::size_t row = 0;
  const double scale = 1 / sigma_px_;
  const auto copy = [scale](const double* from, std::size_t count, double* to) {
    for (std::size_t i = 0; i < count; ++i) to[i] = scale * from[i];
  };
  for (std::size_t k = 0; k < corners; ++k) {
    if (!state_.used[k]) continue;
    const lens::Vec2 error = scale * (pixels[k] - state_.Seen(k));
    residuals[2 * row] = error.x();
    residuals[2 * row + 1] = error.y();
    if (derive && jacobians[0] != nullptr)
      copy(&by_shared[k * 2 * kSharedCount], std::size_t{2} * kSharedCount,
           jacobians[0] + row * 2 * kSharedCount);
    if (derive && jacobians[1] != nullptr) copy(&by_pose[k * 12], 12, jacobians[1] + row * 12);
    ++row;
  }
  return true;
}

SharedVector PriorDeviations(const LensPrior& prior, const target::Board& board,
                             image::ImageSize size, double f) {
  const double r = 0.5 * std::hypot(size.width, size.height) / f;
  const double half_m = board.Centre().norm();
  SharedVector sd;
  sd[kFx] = f * prior.aspect;  // of fx - fy
  sd[kFy] = 0;                 // free
  sd[kCx] = sd[kCy] = prior.centre * size.width;
  sd[kK1] = prior.radial[0] / (r * r);
  sd[kK2] = prior.radial[1] / std::pow(r, 4);
  sd[kK3] = prior.radial[2] / std::pow(r, 6);
  sd[kP1] = sd[kP2] = prior.tangential / (3 * r);
  sd[kBowX] = sd[kBowY] = sd[kBowXY] = 2 * half_m * prior.bow / (half_m * half_m);
  return sd;
}

PriorCost::PriorCost(const SharedVector& sd, image::ImageSize size) {
  rows_.setZero();
  for (int k = 0; k < kSharedCount; ++k) {
    if (sd[k] > 0) rows_(k, k) = 1 / sd[k];
  }
  rows_(kFx, kFy) = -rows_(kFx, kFx);
  mean_.setZero();
  mean_[kCx] = 0.5 * (size.width - 1);
  mean_[kCy] = 0.5 * (size.height - 1);
}

SharedMatrix PriorInformation(const LensPrior& prior, const target::Board& board,
                              image::ImageSize size, double f) {
  return PriorCost(PriorDeviations(prior, board, size, f), size).Information();
}

bool PriorCost::Evaluate(double const* const* parameters, double* residuals,
                         double** jacobians) const {
  const Eigen::Map<const SharedVector> shared(parameters[0]);
  Eigen::Map<SharedVector> out(residuals);
  out = rows_ * (shared - mean_);
  if (jacobians != nullptr && jacobians[0] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, kSharedCount, kSharedCount, Eigen::RowMajor>> by(jacobians[0]);
    by = rows_;
  }
  return true;
}

}  // namespace plumbline::vision
