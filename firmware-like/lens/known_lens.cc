#include "firmware-like/lens/known_lens.h"

#include <cmath>

namespace plumbline::lens {

LensVector VectorOfLens(const Lens& l) {
  LensVector values;
  values << l.fx, l.fy, l.cx, l.cy, l.k1, l.k2, l.p1, l.p2, l.k3, l.k4, l.k5, l.k6, l.s1, l.s2,
      l.s3, l.s4;
  return values;
}

Lens LensOfVector(const LensVector& v, bool fisheye) {
  return {v[0], v[1],  v[2],  v[3],  v[4],  v[5],  v[6],  v[7],   v[8],
          v[9], v[10], v[11], v[12], v[13], v[14], v[15], fisheye};
}

LensModel ModelOf(const Lens& lens) {
  if (lens.fisheye) return LensModel::kFisheye;
  if (lens.s1 != 0 || lens.s2 != 0 || lens.s3 != 0 || lens.s4 != 0) return LensModel::kThinPrism;
  if (lens.k4 != 0 || lens.k5 != 0 || lens.k6 != 0) return LensModel::kRational;
  return LensModel::kUsual;
}

std::string_view ModelName(LensModel model) {
  switch (model) {
    case LensModel::kUsual:
      return "brown";
    case LensModel::kRational:
      return "rational";
    case LensModel::kThinPrism:
      return "thin prism";
    case LensModel::kFisheye:
      break;
  }
  return "fisheye";
}

std::vector<double> DistortionOf(const Lens& l) {
  switch (ModelOf(l)) {
    case LensModel::kFisheye:
      return {l.k1, l.k2, l.k3, l.k4};
    case LensModel::kUsual:
      return {l.k1, l.k2, l.p1, l.p2, l.k3};
    case LensModel::kRational:
      return {l.k1, l.k2, l.p1, l.p2, l.k3, l.k4, l.k5, l.k6};
    case LensModel::kThinPrism:
      break;
  }
  return {l.k1, l.k2, l.p1, l.p2, l.k3, l.k4, l.k5, l.k6, l.s1, l.s2, l.s3, l.s4};
}

bool SetDistortion(const std::vector<double>& values, bool fisheye, Lens& lens) {
  const std::size_t count = values.size();
  lens.fisheye = fisheye;
  if (fisheye) {
    if (count != 4) return false;
    lens.k1 = values[0], lens.k2 = values[1], lens.k3 = values[2], lens.k4 = values[3];
    return true;
  }
  if (count != 5 && count != 8 && count != 12) return false;
  double* const places[] = {&lens.k1, &lens.k2, &lens.p1, &lens.p2, &lens.k3, &lens.k4,
                            &lens.k5, &lens.k6, &lens.s1, &lens.s2, &lens.s3, &lens.s4};
  for (std::size_t k = 0; k < count; ++k) *places[k] = values[k];
  return true;
}

namespace {

/// Derivatives with respect to k1..k4 of a fisheye: theta^(2 i + 1) n / r.
void AddFisheyeColumns(const Lens& lens, const Vec2& n,
                       Eigen::Matrix<double, 2, kLensParameters>& J) {
  const double r = n.norm();
  if (!(r > 1e-6)) return;
  const double theta = std::atan(r), t2 = theta * theta;
  Vec2 column = Vec2(lens.fx * n.x(), lens.fy * n.y()) * (theta / r);
  for (const int k : {4, 5, 8, 9}) J.col(k) = column *= t2;
}

void AddDistortionColumns(const Lens& lens, const Vec2& n,
                          Eigen::Matrix<double, 2, kLensParameters>& J) {
  const double x = n.x(), y = n.y(), r2 = n.squaredNorm();
  const double above = 1 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3));
  const double below = 1 + r2 * (lens.k4 + r2 * (lens.k5 + r2 * lens.k6));
  const Vec2 scaled = Vec2(lens.fx * x, lens.fy * y) / below;
  Vec2 column = scaled;
  for (const int k : {4, 5, 8}) J.col(k) = column *= r2;
  column = -above / below * scaled;
  for (const int k : {9, 10, 11}) J.col(k) = column *= r2;
  J.col(6) << lens.fx * 2 * x * y, lens.fy * (r2 + 2 * y * y);
  J.col(7) << lens.fx * (r2 + 2 * x * x), lens.fy * 2 * x * y;
  J(0, 12) = lens.fx * r2;
  J(0, 13) = lens.fx * r2 * r2;
  J(1, 14) = lens.fy * r2;
  J(1, 15) = lens.fy * r2 * r2;
}

}  // namespace

Eigen::Matrix<double, 2, kLensParameters> PixelByLens(const Lens& lens, const Vec2& n) {
  const Vec2 distorted = DistortedNormalised<double>(lens, n);
  Eigen::Matrix<double, 2, kLensParameters> J = Eigen::Matrix<double, 2, kLensParameters>::Zero();
  J(0, 0) = distorted.x();
  J(1, 1) = distorted.y();
  J(0, 2) = J(1, 3) = 1;
  if (lens.fisheye) {
    AddFisheyeColumns(lens, n, J);
  } else {
    AddDistortionColumns(lens, n, J);
  }
  return J;
}

double UsableShare(const KnownLens& lens) {
  constexpr int kCells = 64;
  int inside = 0;
  for (int row = 0; row < kCells; ++row) {
    for (int column = 0; column < kCells; ++column) {
      const Vec2 pixel((column + 0.5) / kCells * lens.size.width - 0.5,
                       (row + 0.5) / kCells * lens.size.height - 0.5);
      inside += UsableAt(lens, pixel) ? 1 : 0;
    }
  }
  return inside / static_cast<double>(kCells * kCells);
}

}  // namespace plumbline::lens
