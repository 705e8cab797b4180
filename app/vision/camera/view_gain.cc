#include "app/vision/camera/view_gain.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "app/vision/lens/projection_uncertainty.h"
#include "firmware-like/geometry/rotation.h"

namespace plumbline::vision {
namespace {

constexpr double kTilt_rad = 0.5, kCornerTilt_rad = 0.3;
/// Share of the image's width or height that the board fills.
constexpr double kUsualShare = 0.5;
constexpr double kCloseShare = 0.9, kFarShare = 0.35, kCornerShare = 0.4;
constexpr double kMaxOutside = 0.1;  ///< share of corners outside the image

/// Where a prompt places the board: its centre (-1..1 over the space it leaves in the image), its
/// tilts [rad] and the share of the image that it fills.
struct PromptPlacement {
  lens::BoardPrompt prompt;
  double right, down, about_x, about_y, share;
};
constexpr double t = kTilt_rad, c = kCornerTilt_rad;
// A positive turn about y brings the right edge towards the camera, about x the upper one.
constexpr std::array<PromptPlacement, 10> kPlacements = {{
    {lens::BoardPrompt::kTiltLeft, 0, 0, 0, -t, kUsualShare},
    {lens::BoardPrompt::kTiltRight, 0, 0, 0, t, kUsualShare},
    {lens::BoardPrompt::kTiltUpper, 0, 0, t, 0, kUsualShare},
    {lens::BoardPrompt::kTiltLower, 0, 0, -t, 0, kUsualShare},
    {lens::BoardPrompt::kUpperLeft, -1, -1, c, -c, kCornerShare},
    {lens::BoardPrompt::kUpperRight, 1, -1, c, c, kCornerShare},
    {lens::BoardPrompt::kLowerLeft, -1, 1, -c, -c, kCornerShare},
    {lens::BoardPrompt::kLowerRight, 1, 1, -c, c, kCornerShare},
    {lens::BoardPrompt::kCloser, 0, 0, c, c, kCloseShare},
    {lens::BoardPrompt::kFarther, 0, 0, c, -c, kFarShare},
}};

Pose PoseOfPlacement(const PromptPlacement& placement, const target::Board& board,
                     const lens::Lens& lens, image::ImageSize size) {
  const double width_m = 2 * board.Centre().x(), height_m = 2 * board.Centre().y();
  const double z = std::max(lens.fx * width_m / (placement.share * size.width),
                            lens.fy * height_m / (placement.share * size.height));
  const double u = 0.5 * size.width + placement.right * 0.5 * (1 - placement.share) * size.width;
  const double v = 0.5 * size.height + placement.down * 0.5 * (1 - placement.share) * size.height;
  Pose X;
  X.R = RotationFromVector(Vec3(placement.about_x, placement.about_y, 0));
  const Vec3 centre_C((u - lens.cx) / lens.fx * z, (v - lens.cy) / lens.fy * z, z);
  X.p = centre_C - X.R * Vec3(board.Centre().x(), board.Centre().y(), 0);
  return X;
}

}  // namespace

std::optional<SharedMatrix> InformationOfView(const target::Board& board,
                                              const SharedVector& shared, const Pose& X_CK,
                                              image::ImageSize size, double sigma_px) {
  const Eigen::Index n = board.corners();
  std::vector<lens::Vec2> pixels;
  std::vector<double> by_shared(static_cast<std::size_t>(2 * n * kSharedCount));
  std::vector<double> by_pose(static_cast<std::size_t>(2 * n * 6));
  if (!BoardPixels(board, shared, X_CK.R, Vec3::Zero(), X_CK.p, pixels, by_shared.data(),
                   by_pose.data())) {
    return std::nullopt;
  }
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Eigen::MatrixXd S = Eigen::Map<RowMajor>(by_shared.data(), 2 * n, kSharedCount);
  Eigen::MatrixXd P = Eigen::Map<RowMajor>(by_pose.data(), 2 * n, 6);
  Eigen::Index outside = 0;
  for (Eigen::Index k = 0; k < n; ++k) {
    const lens::Vec2& at = pixels[k];
    const bool inside =
        at.allFinite() && at.x() >= 0 && at.y() >= 0 && at.x() < size.width && at.y() < size.height;
    if (inside) continue;
    ++outside;
    S.middleRows<2>(2 * k).setZero();
    P.middleRows<2>(2 * k).setZero();
  }
  if (static_cast<double>(outside) > kMaxOutside * static_cast<double>(n)) return std::nullopt;
  const Eigen::MatrixXd PtS = P.transpose() * S;
  const Eigen::MatrixXd information =
      S.transpose() * S - PtS.transpose() * (P.transpose() * P).ldlt().solve(PtS);
  if (!information.allFinite()) return std::nullopt;
  return SharedMatrix(information / (sigma_px * sigma_px));
}

Pose PoseOfPrompt(lens::BoardPrompt prompt, const target::Board& board, const lens::Lens& lens,
                  image::ImageSize size) {
  const auto* placement = std::ranges::find_if(
      kPlacements, [&](const PromptPlacement& p) { return p.prompt == prompt; });
  return PoseOfPlacement(placement != kPlacements.end() ? *placement : kPlacements[0], board, lens,
                         size);
}

lens::BoardPrompt BestPrompt(const target::Board& board, const LensFit& fit, image::ImageSize size,
                             const std::set<lens::BoardPrompt>& avoid) {
  const lens::Lens lens = LensFromShared(fit.shared);
  lens::BoardPrompt best = lens::BoardPrompt::kShowBoard;
  double least = INFINITY;
  for (const PromptPlacement& placement : kPlacements) {
    if (avoid.contains(placement.prompt)) continue;
    const auto information = InformationOfView(
        board, fit.shared, PoseOfPlacement(placement, board, lens, size), size, fit.sigma_px);
    if (!information) continue;
    // C' = (C^-1 + I)^-1 = C (1 + I C)^-1, which avoids inverting C: dropped terms have zero
    // variance.
    const SharedMatrix gained =
        fit.covariance * (SharedMatrix::Identity() + *information * fit.covariance).inverse();
    const LensMatrix covariance = gained.topLeftCorner<kLensCount, kLensCount>();
    const double worst = ProjectionUncertaintyOf(lens, covariance, size).max_px;
    if (worst < least) least = worst, best = placement.prompt;
  }
  return best;
}

}  // namespace plumbline::vision
