// Position of the tool tip measured by a camera relative to the cell's reference tags.
#pragma once

#include <array>
#include <optional>

#include "app/vision/tracking/bodies.h"

namespace plumbline::vision {

/// Position of a point of a body in the measurement frame W.
struct CameraPoint {
  Vec3 p_W = Vec3::Zero();
  Mat3 covariance_W = Mat3::Zero();  ///< from image noise and the lens [m^2]
  Mat3 tag_covariance_W =
      Mat3::Zero();   ///< additionally from errors of the tags' declared positions [m^2]
  double time_s = 0;  ///< when the image was taken, monotonic
};

/// Standard deviation of the declared tag positions, per axis [m]: on the cell's body and on the
/// tool's body.
struct TagPositionSd {
  double cell_sd_m = 0, tool_sd_m = 0;
};

/// p_W = X_WK X_CK^-1 X_CT p_TQ, with both bodies located in one image:
///   K the cell's body (X_CK), T the tool's (X_CT).
/// The corner noise of the two is independent. A lens error moves both and largely cancels, so it
/// is propagated through both poses together. Errors of the declared positions are reported
/// separately: they are the same in every image of the same tags from the same direction, and
/// averaging does not reduce them.
/// @param X_WK  the cell's body in the measurement frame, as declared
/// @param p_TQ  the point on the tool's body [m]
CameraPoint MeasurePoint(const PoseEstimate& cell, const PoseEstimate& tool, const Pose& X_WK,
                         const Vec3& p_TQ, const lens::LensCovariance& lens, double time_s,
                         const TagPositionSd& places = {});

/// Reports a point only while it is stationary: each pair of the last kSamples measurements agrees
/// within four standard deviations plus 20 um for errors the images share.
class StationaryPointFilter {
 public:
  static constexpr std::size_t kSamples = 3;
  void Take(const CameraPoint& point);
  void Reset() { count_ = 0; }
  /// Mean of the last samples, with the covariance of one sample, because shared errors do not
  /// average out. @return  nullopt unless the point is stationary
  std::optional<CameraPoint> Point() const;

 private:
  std::array<CameraPoint, kSamples> samples_;
  std::size_t count_ = 0;
};

}  // namespace plumbline::vision
