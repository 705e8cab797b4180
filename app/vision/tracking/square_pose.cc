// PosesOfSquare: the two poses of a flat square.
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "app/vision/tracking/decode.h"
#include "app/vision/tracking/tag_pose.h"
#include "firmware-like/geometry/rotation.h"

namespace plumbline::vision {
namespace {

/// The larger singular value of A, the sum of its conformal and its anticonformal part.
double LargerSingularValue(const Eigen::Matrix2d& A) {
  return 0.5 * (std::hypot(A(0, 0) + A(1, 1), A(0, 1) - A(1, 0)) +
                std::hypot(A(0, 0) - A(1, 1), A(0, 1) + A(1, 0)));
}

/// Least-squares translation p: a corner q = R p_K seen in direction (x, y) gives
/// p_x - x p_z = x q_z - q_x and p_y - y p_z = y q_z - q_y.
Vec3 TranslationFor(const Mat3& R, const std::array<lens::Vec2, 4>& normalised,
                    const std::array<Vec3, 4>& corners) {
  Mat3 normal = Mat3::Zero();
  Vec3 right = Vec3::Zero();
  for (int k = 0; k < 4; ++k) {
    const Vec3 q = R * corners[k];
    for (int axis = 0; axis < 2; ++axis) {
      const Vec3 row = Vec3::Unit(axis) - normalised[k][axis] * Vec3::UnitZ();
      normal += row * row.transpose();
      right += row * (normalised[k][axis] * q.z() - q[axis]);
    }
  }
  return normal.ldlt().solve(right);
}

double Misfit(const Pose& X, const std::array<lens::Vec2, 4>& normalised,
              const std::array<Vec3, 4>& corners) {
  double sum = 0;
  for (int k = 0; k < 4; ++k) {
    const Vec3 p = X * corners[k];
    sum += (p.head<2>() / p.z() - normalised[k]).squaredNorm();
  }
  return sum;
}

}  // namespace

std::array<Vec3, 4> CornersInTag(double side_m) {
  const double h = 0.5 * side_m;
  return {Vec3(-h, -h, 0), Vec3(h, -h, 0), Vec3(h, h, 0), Vec3(-h, h, 0)};
}

std::vector<Pose> PosesOfSquare(const std::array<lens::Vec2, 4>& normalised, double side_m) {
  Mat3 unit_of_tag;
  unit_of_tag << 1 / side_m, 0, 0.5, 0, 1 / side_m, 0.5, 0, 0, 1;
  Mat3 H = MapOfUnitSquare(normalised) * unit_of_tag;
  if (!H.allFinite() || std::abs(H(2, 2)) < 1e-12) return {};
  H /= H(2, 2);
  // Image of the tag's centre, and the derivative of the homography there.
  const lens::Vec2 v(H(0, 2), H(1, 2));
  Eigen::Matrix2d J;
  J << H(0, 0) - H(2, 0) * v.x(), H(0, 1) - H(2, 1) * v.x(), H(1, 0) - H(2, 0) * v.y(),
      H(1, 1) - H(2, 1) * v.y();
  const Mat3 R_v = RotationOfZOnto(Vec3(v.x(), v.y(), 1));
  Eigen::Matrix<double, 2, 3> P;
  P << 1, 0, -v.x(), 0, 1, -v.y();
  const Eigen::Matrix2d B = (P * R_v).leftCols<2>();
  const Eigen::Matrix2d A = B.inverse() * J;
  const double largest = LargerSingularValue(A);
  if (!(largest > 1e-12)) return {};
  const Eigen::Matrix2d upper = A / largest;  // upper left 2 x 2 block of the rotation
  const Eigen::Matrix2d rest = Eigen::Matrix2d::Identity() - upper.transpose() * upper;
  lens::Vec2 b(std::sqrt(std::max(0.0, rest(0, 0))), std::sqrt(std::max(0.0, rest(1, 1))));
  if (rest(0, 1) < 0) b.y() = -b.y();

  const auto corners = CornersInTag(side_m);
  std::vector<Pose> poses;
  for (const double sign : {1.0, -1.0}) {
    Mat3 R;
    R.col(0) << upper.col(0), sign * b.x();
    R.col(1) << upper.col(1), sign * b.y();
    R.col(2) = R.col(0).cross(R.col(1));
    R = R_v * R;
    // Re-orthonormalize: rounding and an inexact homography leave small errors.
    R = Eigen::Quaterniond(R).normalized().toRotationMatrix();
    const Pose X{R, TranslationFor(R, normalised, corners)};
    if (X.p.allFinite() && X.p.z() > 0) poses.push_back(X);
  }
  if (poses.size() == 2 &&
      Misfit(poses[1], normalised, corners) < Misfit(poses[0], normalised, corners)) {
    std::swap(poses[0], poses[1]);
  }
  return poses;
}

}  // namespace plumbline::vision
