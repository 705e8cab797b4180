#include "app/cell/view_link/json_values.h"

#include <cmath>

#include "firmware-like/status/camera_status.h"

namespace plumbline::cell {

double NumberOf(const Json& json) {
  return json.is_null() ? status::CameraStatus::kNever : json.get<double>();
}

Vec3 Vec3Of(const Json& json) {
  Vec3 v;
  ReadVector(json, v);
  return v;
}

model::JointVector JointsOf(const Json& json) {
  if (json.size() > model::kMaxJoints) throw std::out_of_range("too many joints");
  model::JointVector q(static_cast<Eigen::Index>(json.size()));
  ReadVector(json, q);
  return q;
}

Json PoseJson(const Pose& X) {
  const Eigen::Quaterniond q(X.R);
  return {{"p_m", VectorJson(X.p)}, {"quaternion_wxyz", {q.w(), q.x(), q.y(), q.z()}}};
}

Pose PoseOfJson(const Json& json) {
  Eigen::Vector4d q;
  ReadVector(json.at("quaternion_wxyz"), q);
  if (!(std::abs(q.norm() - 1) < 1e-3)) throw std::out_of_range("a quaternion is not normalised");
  const Eigen::Quaterniond turn(q[0], q[1], q[2], q[3]);
  return {turn.normalized().toRotationMatrix(), Vec3Of(json.at("p_m"))};
}

}  // namespace plumbline::cell
