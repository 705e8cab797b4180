#include "app/vision/lens/lens_model.h"

#include <cmath>

#include "firmware-like/geometry/rotation.h"

namespace plumbline::vision {
namespace {

constexpr double kMinDistance_m = 1e-4;
constexpr double kSmallTurn = 1e-8;

Mat3 ExpSo3(const Vec3& w) {
  const double angle = w.norm();
  if (angle < kSmallTurn) return Mat3::Identity() + CrossMatrix(w);
  return Eigen::AngleAxisd(angle, w / angle).toRotationMatrix();
}

/// exp(w + dw) = exp(w) exp(J dw)   [J. Sola et al., arXiv 1812.01537, eq. 143]
Mat3 RightJacobian(const Vec3& w) {
  const double angle2 = w.squaredNorm(), angle = std::sqrt(angle2);
  if (angle < kSmallTurn) return Mat3::Identity() - 0.5 * CrossMatrix(w);
  const Mat3 W = CrossMatrix(w);
  return Mat3::Identity() - (1 - std::cos(angle)) / angle2 * W +
         (angle - std::sin(angle)) / (angle2 * angle) * W * W;
}

}  // namespace

lens::Lens LensFromShared(const SharedVector& s) {
  return {s[kFx], s[kFy], s[kCx], s[kCy], s[kK1], s[kK2], s[kP1], s[kP2], s[kK3]};
}

SharedVector SharedOfLens(const lens::Lens& lens) {
  SharedVector s = SharedVector::Zero();
  s.head<kLensCount>() << lens.fx, lens.fy, lens.cx, lens.cy, lens.k1, lens.k2, lens.p1, lens.p2,
      lens.k3;
  return s;
}

bool BoardPixels(const target::Board& board, const SharedVector& shared, const Mat3& R_start,
                 const Vec3& turn, const Vec3& p_CK, std::vector<lens::Vec2>& pixels,
                 double* d_shared, double* d_pose) {
  const lens::Lens lens = LensFromShared(shared);
  const Mat3 R = R_start * ExpSo3(turn);
  const Mat3 J_turn = RightJacobian(turn);
  const lens::Vec2 centre = board.Centre();
  pixels.resize(board.corners());
  for (int k = 0; k < board.corners(); ++k) {
    const lens::Vec2 xy = board.Corner(k);
    const double u = xy.x() - centre.x(), v = xy.y() - centre.y();
    const Vec3 p_K(xy.x(), xy.y(),
                   shared[kBowX] * u * u + shared[kBowY] * v * v + shared[kBowXY] * u * v);
    const Vec3 p_C = R * p_K + p_CK;
    if (!(p_C.z() > kMinDistance_m)) return false;
    const double x = p_C.x() / p_C.z(), y = p_C.y() / p_C.z();
    const lens::Vec2 pixel = lens::PixelOfNormalised(lens, lens::Vec2(x, y));
    pixels[k] = pixel;
    if (d_shared == nullptr) continue;
    const double r2 = x * x + y * y;
    const Eigen::Matrix2d d_n = lens::PixelJacobian(lens, {x, y});
    Eigen::Matrix<double, 2, 3>
        d_point;  // of the pixel with respect to the point in the camera frame
    d_point << d_n / p_C.z(), -d_n * lens::Vec2(x, y) / p_C.z();
    using Row = Eigen::Matrix<double, 2, kSharedCount, Eigen::RowMajor>;
    Eigen::Map<Row> by_shared(d_shared + std::size_t{2} * kSharedCount * k);
    by_shared.setZero();
    by_shared(0, kFx) = (pixel.x() - lens.cx) / shared[kFx];
    by_shared(1, kFy) = (pixel.y() - lens.cy) / shared[kFy];
    by_shared(0, kCx) = by_shared(1, kCy) = 1;
    const lens::Vec2 fxy(lens.fx * x, lens.fy * y);
    by_shared.col(kK1) = fxy * r2;
    by_shared.col(kK2) = fxy * (r2 * r2);
    by_shared.col(kK3) = fxy * (r2 * r2 * r2);
    by_shared.col(kP1) << lens.fx * 2 * x * y, lens.fy * (r2 + 2 * y * y);
    by_shared.col(kP2) << lens.fx * (r2 + 2 * x * x), lens.fy * 2 * x * y;
    const lens::Vec2 by_height = d_point * R.col(2);
    by_shared.col(kBowX) = by_height * (u * u);
    by_shared.col(kBowY) = by_height * (v * v);
    by_shared.col(kBowXY) = by_height * (u * v);
    Eigen::Map<Eigen::Matrix<double, 2, 6, Eigen::RowMajor>> by_pose(d_pose + std::size_t{12} * k);
    by_pose.leftCols<3>() = -d_point * R * CrossMatrix(p_K) * J_turn;
    by_pose.rightCols<3>() = d_point;
  }
  return true;
}

}  // namespace plumbline::vision
