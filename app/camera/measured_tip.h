// The tool's tip by camera, against the cell's fixed tags.
#pragma once

#include <array>
#include <optional>

#include "app/tracking/bodies.h"

namespace plumbline {

/// Where a point of a body is in the measurement frame W.
struct PointByCamera {
  Vec3 p_W = Vec3::Zero();
  Mat3 covariance_W = Mat3::Zero();  ///< by the image's noise and the lens [m^2]
  Mat3 places_W = Mat3::Zero();      ///< besides, by errors of the tags' declared places [m^2]
  double time_s = 0;                 ///< when the image was taken, monotonic
};

/// How well the places of the tags on their bodies are known, a deviation along each axis [m].
struct PlaceErrors {
  double cell_sd_m = 0, tool_sd_m = 0;
};

/// p_W = X_WK X_CK^-1 X_CT p_TQ, both bodies from one image:
///   K the cell's body (X_CK), T the tool's (X_CT).
/// The corners' noise of the two is independent; an error of the lens moves both, and mostly falls
/// out: it is followed through both poses. Errors of the tags' declared places are told apart: they
/// are the same in every image that shows the same tags from there, and no mean makes them less.
/// @param X_WK  the cell's body in the measurement frame, as declared
/// @param p_TQ  the point on the tool's body [m]
PointByCamera MeasurePoint(const PoseEstimate& cell, const PoseEstimate& tool, const Pose& X_WK,
                           const Vec3& p_TQ, const LensCovariance& lens, double time_s,
                           const PlaceErrors& places = {});

/// Whether a point stood over the last kLooks images: every two of them agree within four of their
/// deviations, and 20 um besides for what their images share.
class Standing {
 public:
  static constexpr std::size_t kLooks = 3;
  void Take(const PointByCamera& point);
  void Forget() { count_ = 0; }
  /// The mean of the last looks, its covariance that of one: what they share does not average out.
  std::optional<PointByCamera> Point() const;

 private:
  std::array<PointByCamera, kLooks> looks_;
  std::size_t count_ = 0;
};

}  // namespace plumbline
