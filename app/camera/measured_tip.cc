#include "app/camera/measured_tip.h"

#include <algorithm>
#include <cmath>

#include "firmware-like/geometry/rotation.h"

namespace plumbline {
namespace {

constexpr double kDeviations = 4, kShared_m = 2e-5, kLongestGap_s = 1;

using PointByPose = Eigen::Matrix<double, 3, 6>;

/// The part of a pose's covariance that its own corners' noise makes.
Mat6 NoiseOf(const PoseEstimate& pose, const LensCovariance& lens) {
  return pose.covariance - pose.by_lens * lens * pose.by_lens.transpose();
}

}  // namespace

PointByCamera MeasurePoint(const PoseEstimate& cell, const PoseEstimate& tool, const Pose& X_WK,
                           const Vec3& p_TQ, const LensCovariance& lens, double time_s,
                           const PlaceErrors& places) {
  const Vec3 turned_C = tool.X_CK.R * p_TQ;  // from the tool's origin, along the camera's axes
  const Vec3 p_CQ = turned_C + tool.X_CK.p;
  const Mat3 R_WC = X_WK.R * cell.X_CK.R.transpose();
  PointByPose by_tool, by_cell;
  by_tool << R_WC, -R_WC * CrossMatrix(turned_C);
  // The cell's pose moved by (delta, phi) moves the point by the opposite, as seen from the cell.
  by_cell << -R_WC, R_WC * CrossMatrix(p_CQ - cell.X_CK.p);
  const Eigen::Matrix<double, 3, 9> by_lens = by_tool * tool.by_lens + by_cell * cell.by_lens;
  PointByCamera point;
  point.p_W = X_WK * (cell.X_CK.Inverse() * p_CQ);
  point.covariance_W = by_tool * NoiseOf(tool, lens) * by_tool.transpose() +
                       by_cell * NoiseOf(cell, lens) * by_cell.transpose() +
                       by_lens * lens * by_lens.transpose();
  point.places_W =
      places.tool_sd_m * places.tool_sd_m * by_tool * tool.by_places * by_tool.transpose() +
      places.cell_sd_m * places.cell_sd_m * by_cell * cell.by_places * by_cell.transpose();
  point.time_s = time_s;
  return point;
}

void Standing::Take(const PointByCamera& point) {
  const bool gap = count_ > 0 && point.time_s - looks_[kLooks - 1].time_s > kLongestGap_s;
  if (gap || !point.p_W.allFinite() || !point.covariance_W.allFinite()) count_ = 0;
  if (!point.p_W.allFinite() || !point.covariance_W.allFinite()) return;
  std::rotate(looks_.begin(), looks_.begin() + 1, looks_.end());
  looks_.back() = point;
  count_ = std::min(count_ + 1, kLooks);
}

std::optional<PointByCamera> Standing::Point() const {
  if (count_ < kLooks) return std::nullopt;
  PointByCamera mean = looks_.back();
  mean.p_W.setZero();
  for (const PointByCamera& a : looks_) {
    for (const PointByCamera& b : looks_) {
      const Vec3 apart = a.p_W - b.p_W;
      const Vec3 variance = a.covariance_W.diagonal() + b.covariance_W.diagonal();
      const Vec3 limit = kDeviations * variance.cwiseMax(0).cwiseSqrt() + Vec3::Constant(kShared_m);
      if ((apart.cwiseAbs().array() > limit.array()).any()) return std::nullopt;
    }
    mean.p_W += a.p_W / static_cast<double>(kLooks);
  }
  return mean;
}

}  // namespace plumbline
