// Pose in which a person sees the board in the outline on the display.
#pragma once

#include <Eigen/SVD>
#include <cmath>
#include <vector>

#include "app/vision/camera/next_view.h"
#include "firmware-like/geometry/rotation.h"

namespace plumbline::test {

/// Pose of a board whose outline appears as BoardGuidance::wanted_px shows it, from the homography
/// of the outline's points.
inline Pose PoseOfOutline(const std::vector<lens::Vec2>& outline_px, const target::Board& board,
                          const lens::Lens& lens) {
  const std::vector<lens::Vec2> straight = vision::OutlineOf(
      board, lens::Lens{1, 1, 0, 0}, {Mat3::Identity(), Vec3(0, 0, 1)});  // in the board's plane
  Eigen::MatrixXd A(2 * outline_px.size(), 9);
  for (std::size_t k = 0; k < outline_px.size(); ++k) {
    const Vec3 p(straight[k].x(), straight[k].y(), 1);
    const lens::Vec2 n = lens::NormalisedOfPixel(lens, outline_px[k]).value();
    A.row(2 * k) << p.transpose(), 0, 0, 0, -n.x() * p.transpose();
    A.row(2 * k + 1) << 0, 0, 0, p.transpose(), -n.y() * p.transpose();
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(A, Eigen::ComputeFullV);
  const Eigen::VectorXd h = svd.matrixV().col(8);
  Mat3 H;
  H << h.head<3>().transpose(), h.segment<3>(3).transpose(), h.tail<3>().transpose();
  H /= std::copysign(0.5 * (H.col(0).norm() + H.col(1).norm()), H(2, 2));
  Mat3 R;
  R << H.col(0), H.col(1), H.col(0).cross(H.col(1));
  return {NearestRotation(R), H.col(2)};
}

}  // namespace plumbline::test
