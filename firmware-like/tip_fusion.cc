#include "firmware-like/tip_fusion.h"

#include <Eigen/LU>
#include <array>

namespace plumbline {

namespace {

bool Agree(const MeasuredTip& a, const MeasuredTip& b) {
  const Mat3 covariance = a.covariance_W + a.tag_covariance_W + b.covariance_W + b.tag_covariance_W;
  const Vec3 apart = a.p_W - b.p_W;
  return apart.dot(Mat3(covariance.inverse()) * apart) <= kTipAgreementLimit;
}

}  // namespace

TipFusion FuseTips(std::span<const MeasuredTip> tips) {
  TipFusion fused;
  if (tips.size() == 1) {
    fused.tip = tips.front();
    return fused;
  }
  std::array<Mat3, model::kMaxCameras> information;
  Mat3 sum = Mat3::Zero();
  for (std::size_t k = 0; k < tips.size(); ++k) {
    information[k] = tips[k].covariance_W.inverse();
    sum += information[k];
  }
  fused.tip.covariance_W = sum.inverse();
  for (std::size_t k = 0; k < tips.size(); ++k) {
    const Mat3 W = fused.tip.covariance_W * information[k];
    fused.tip.p_W += W * tips[k].p_W;
    fused.tip.tag_covariance_W += W * tips[k].tag_covariance_W * W.transpose();
    for (std::size_t other = 0; other < k; ++other) {
      fused.agree = fused.agree && Agree(tips[k], tips[other]);
    }
  }
  // A singular covariance yields non-finite weights.
  fused.agree = fused.agree && fused.tip.p_W.allFinite() && fused.tip.covariance_W.allFinite();
  return fused;
}

}  // namespace plumbline
