// JSON representation of vectors and rotations in result files.
#pragma once

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "firmware-like/geometry/pose.h"

namespace plumbline::vision {

inline nlohmann::ordered_json JsonOfVector(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

/// Quaternion w, x, y, z of a rotation, w >= 0.
inline nlohmann::ordered_json JsonOfRotation(const Mat3& R) {
  Eigen::Quaterniond q(R);
  q.normalize();
  if (q.w() < 0) q.coeffs() *= -1;
  return {q.w(), q.x(), q.y(), q.z()};
}

}  // namespace plumbline::vision
