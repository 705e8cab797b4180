#include "app/vision/camera/measured_tip.h"

#include <algorithm>
#include <cmath>

#include "firmware-like/geometry/rotation.h"

namespace plumbline::vision {
namespace {

constexpr double kDeviations = 4, kShared_m = 2e-5, kMaxGap_s = 1;

using PointByPose = Eigen::Matrix<double, 3, 6>;

/// The part of a pose's covariance that is due to its own corner noise.
Mat6 NoiseOf(const PoseEstimate& pose, const lens::LensCovariance& lens) {
  return pose.covariance - pose.by_lens * lens * pose.by_lens.transpose();
}

}  // namespace

CameraPoint MeasurePoint(const PoseEstimate& cell, const PoseEstimate& tool, const Pose& X_WK,
                         const Vec3& p_TQ, const lens::LensCovariance& lens, double time_s,
                         const TagPositionSd& places) {
  const Vec3 turned_C = tool.X_CK.R * p_TQ;  // from the tool's origin, in the camera's axes
  const Vec3 p_CQ = turned_C + tool.X_CK.p;
  const Mat3 R_WC = X_WK.R * cell.X_CK.R.transpose();
  PointByPose by_tool, by_cell;
  by_tool << R_WC, -R_WC * CrossMatrix(turned_C);
  // Moving the cell's pose by (delta, phi) moves the point by the opposite as seen from the cell.
  by_cell << -R_WC, R_WC * CrossMatrix(p_CQ - cell.X_CK.p);
  const Eigen::Matrix<double, 3, lens::kLensParameters> by_lens =
      by_tool * tool.by_lens + by_cell * cell.by_lens;
  CameraPoint point;
  point.p_W = X_WK * (cell.X_CK.Inverse() * p_CQ);
  point.covariance_W = by_tool * NoiseOf(tool, lens) * by_tool.transpose() +
                       by_cell * NoiseOf(cell, lens) * by_cell.transpose() +
                       by_lens * lens * by_lens.transpose();
  point.tag_covariance_W = places.tool_sd_m * places.tool_sd_m * by_tool *
                               tool.unit_position_covariance * by_tool.transpose() +
                           places.cell_sd_m * places.cell_sd_m * by_cell *
                               cell.unit_position_covariance * by_cell.transpose();
  point.time_s = time_s;
  return point;
}

void StationaryPointFilter::Take(const CameraPoint& point) {
  const bool gap = count_ > 0 && point.time_s - samples_[kSamples - 1].time_s > kMaxGap_s;
  if (gap || !point.p_W.allFinite() || !point.covariance_W.allFinite()) count_ = 0;
  if (!point.p_W.allFinite() || !point.covariance_W.allFinite()) return;
  std::rotate(samples_.begin(), samples_.begin() + 1, samples_.end());
  samples_.back() = point;
  count_ = std::min(count_ + 1, kSamples);
}

std::optional<CameraPoint> StationaryPointFilter::Point() const {
  if (count_ < kSamples) return std::nullopt;
  CameraPoint mean = samples_.back();
  mean.p_W.setZero();
  for (const CameraPoint& a : samples_) {
    for (const CameraPoint& b : samples_) {
      const Vec3 apart = a.p_W - b.p_W;
      const Vec3 variance = a.covariance_W.diagonal() + b.covariance_W.diagonal();
      const Vec3 limit = kDeviations * variance.cwiseMax(0).cwiseSqrt() + Vec3::Constant(kShared_m);
      if ((apart.cwiseAbs().array() > limit.array()).any()) return std::nullopt;
    }
    mean.p_W += a.p_W / static_cast<double>(kSamples);
  }
  return mean;
}

}  // namespace plumbline::vision
