// Poses of the tracked bodies and the position of the tool tip, for the status of a camera.
#pragma once

#include <array>
#include <vector>

#include "app/vision/camera/measured_tip.h"
#include "app/vision/camera/supervision_settings.h"
#include "app/vision/tracking/bodies.h"
#include "firmware-like/status/camera_status.h"

namespace plumbline::vision {

class TrackedBodies {
 public:
  /// The bodies of one image.
  /// @param lens  covariance of the lens that they were located with
  void Take(const LensSupervisorSettings& settings, const std::vector<SeenBody>& seen,
            const lens::LensCovariance& lens, double image_s);
  /// No body is valid until the next image.
  void Invalidate();
  /// Restarts the measurement of the tip; the bodies stay valid.
  void ResetTip() { tip_.Reset(); }

  /// Sets the bodies of the status, and its tip if the lens is valid.
  void AddTo(status::CameraStatus& status, bool lens_valid) const;

 private:
  std::array<status::CameraStatus::Body, status::CameraStatus::kMaxBodies> bodies_;
  StationaryPointFilter tip_;
};

}  // namespace plumbline::vision
