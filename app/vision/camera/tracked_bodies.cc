#include "app/vision/camera/tracked_bodies.h"

#include <string>

#include "firmware-like/statistics/containment_radius.h"

namespace plumbline::vision {
namespace {

const SeenBody* FindBody(const std::vector<SeenBody>& bodies, const std::string& name) {
  for (const SeenBody& body : bodies) {
    if (body.body->name == name) return &body;
  }
  return nullptr;
}

}  // namespace

void TrackedBodies::Take(const LensSupervisorSettings& settings, const std::vector<SeenBody>& seen,
                         const lens::LensCovariance& lens, double image_s) {
  const SeenBody* const cell = FindBody(seen, settings.cell.name);
  const auto places = [&settings](const SeenBody& body) {
    return TagPositionSd{settings.tag_check.place_sd_m,
                         body.body->place_sd_m.value_or(target::kPlaceSdOnOnePlate_m)};
  };
  for (std::size_t k = 0; k < settings.bodies.size() && k < bodies_.size(); ++k) {
    const SeenBody* const body = FindBody(seen, settings.bodies[k]);
    status::CameraStatus::Body& status = bodies_[k];
    status.valid = body != nullptr && cell != nullptr;
    if (!status.valid) continue;
    status.ambiguous = body->ambiguous || cell->ambiguous;
    status.X_WK = settings.X_WK * (cell->estimate.X_CK.Inverse() * body->estimate.X_CK);
    const CameraPoint origin = MeasurePoint(cell->estimate, body->estimate, settings.X_WK,
                                            Vec3::Zero(), lens, image_s, places(*body));
    status.radius_m =
        statistics::RadiusHolding95Percent(origin.covariance_W + origin.tag_covariance_W);
    status.time_s = image_s;
  }
  const SeenBody* const tool = settings.tool.empty() ? nullptr : FindBody(seen, settings.tool);
  const bool reliable = tool != nullptr && cell != nullptr && !tool->ambiguous &&
                        !cell->ambiguous && cell->used.size() >= 2;
  if (reliable) {
    tip_.Take(MeasurePoint(cell->estimate, tool->estimate, settings.X_WK, settings.tip_T, lens,
                           image_s, places(*tool)));
  } else {
    tip_.Reset();
  }
}

void TrackedBodies::Invalidate() {
  tip_.Reset();
  for (status::CameraStatus::Body& body : bodies_) body.valid = false;
}

void TrackedBodies::AddTo(status::CameraStatus& status, bool lens_valid) const {
  status.bodies = bodies_;
  const auto tip = tip_.Point();
  if (!tip || !lens_valid) return;
  status.tip_valid = true;
  status.tip_W = tip->p_W;
  status.tip_covariance_W = tip->covariance_W;
  status.tip_tag_covariance_W = tip->tag_covariance_W;
  status.tip_time_s = tip->time_s;
}

}  // namespace plumbline::vision
