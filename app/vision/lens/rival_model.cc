#include "app/vision/lens/rival_model.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <utility>

namespace plumbline::vision {
namespace {

constexpr double kGlassIndex = 1.5;
constexpr double kMinDepth_m = 1e-4;

/// Offset of a ray behind a plane-parallel plate, measured in the plate's plane, per unit of
/// thickness: d' / cos' - d / cos.
Vec3 GlassOffset(const Vec3& normal, const Vec3& d) {
  const double cosine = std::max(0.05, d.dot(normal));
  const Vec3 across = (d - d.dot(normal) * normal) / kGlassIndex;
  const double inside = std::sqrt(std::max(1e-6, 1 - across.squaredNorm()));
  return across / inside + normal - d / cosine;
}

Vec3 ThroughGlass(const ExtraVector& extra, const Vec3& board_normal, Vec3 p_C) {
  if (extra[kBoardGlass] != 0) {
    const Vec3 offset = GlassOffset(board_normal, p_C.normalized());
    p_C -= extra[kBoardGlass] * offset;
  }
  const Vec3 pane(extra[kPaneX], extra[kPaneY], extra[kPaneZ]);
  if (pane.z() == 0) return p_C;
  const double thickness_m = std::copysign(pane.norm(), pane.z());
  const Vec3 normal = pane / thickness_m;
  Vec3 seen = p_C;
  for (int pass = 0; pass < 2; ++pass)
    seen = p_C - thickness_m * GlassOffset(normal, seen.normalized());
  return seen;
}

/// Values of cos(i pi a) cos(j pi b) with lowest <= i + j <= highest, a and b in 0..1.
template <int kTerms>
Eigen::Matrix<double, kTerms, 1> Cosines(double a, double b, int lowest, int highest) {
  Eigen::Matrix<double, kTerms, 1> values = Eigen::Matrix<double, kTerms, 1>::Zero();
  int term = 0;
  for (int degree = lowest; degree <= highest; ++degree) {
    for (int i = 0; i <= degree && term < kTerms; ++i) {
      values[term++] =
          std::cos(std::numbers::pi * i * a) * std::cos(std::numbers::pi * (degree - i) * b);
    }
  }
  return values;
}

}  // namespace

lens::Vec2 RivalPixelOf(bool fisheye, const SharedVector& s, const ExtraVector& e,
                        const Vec3& p_C) {
  double x = p_C.x() / p_C.z(), y = p_C.y() / p_C.z();
  if (fisheye) {
    const double r = std::hypot(x, y);
    const double theta = std::atan(r), t2 = theta * theta;
    const double bent = theta * (1 + t2 * (s[kK1] + t2 * (s[kK2] + t2 * (s[kK3] + t2 * e[kK4]))));
    const double scale = r > 1e-9 ? bent / r : 1;
    x *= scale;
    y *= scale;
  } else {
    const double r2 = x * x + y * y, r4 = r2 * r2;
    const double radial = (1 + r2 * (s[kK1] + r2 * (s[kK2] + r2 * s[kK3]))) /
                          (1 + r2 * (e[kK4] + r2 * (e[kK5] + r2 * e[kK6])));
    const double u = radial * x + 2 * s[kP1] * x * y + s[kP2] * (r2 + 2 * x * x) + e[kPrism1] * r2 +
                     e[kPrism2] * r4;
    y = radial * y + s[kP1] * (r2 + 2 * y * y) + 2 * s[kP2] * x * y + e[kPrism3] * r2 +
        e[kPrism4] * r4;
    x = u;
  }
  const double zoom = std::exp(e[kZoom]);
  return {zoom * s[kFx] * x + s[kCx] + e[kShiftX], zoom * s[kFy] * y + s[kCy] + e[kShiftY]};
}

RivalBoard::RivalBoard(const target::Board& board, std::vector<std::size_t> corners)
    : centre_(board.Centre()), half_m_(board.Centre().norm()) {
  for (const std::size_t corner : corners) {
    Point point;
    point.corner = corner;
    point.xy = board.Corner(static_cast<int>(corner));
    point.uv = point.xy - centre_;
    const double a = 0.5 * point.xy.x() / centre_.x(), b = 0.5 * point.xy.y() / centre_.y();
    point.height = Cosines<kHeightTerms>(a, b, 2, 5);  // the pose has the lower degrees
    point.print = Cosines<kPrintTerms>(a, b, 2, 4);
    points_.push_back(point);
  }
}

bool RivalPixels(const RivalBoard& board, image::ImageSize size, bool fisheye,
                 const SharedVector& shared, const ExtraVector& extra, const Pose& X_CK,
                 const std::vector<double>& rows_px, std::vector<lens::Vec2>& pixels) {
  const Vec3 velocity = extra.segment<3>(kVelocityX), spin = extra.segment<3>(kSpinX);
  const bool moves = !velocity.isZero(0) || !spin.isZero(0);
  const bool shaped = !extra.segment<kHeightTerms>(kHeight).isZero(0);
  const bool printed = !extra.segment<2 * kPrintTerms>(kPrintX).isZero(0);
  const bool freed = !extra.segment<3 * kMaxFreePoints>(kFree).isZero(0);
  const Vec3 centre(board.centre().x(), board.centre().y(), 0);
  Vec3 normal = X_CK.R.col(2);
  if (normal.z() < 0) normal = -normal;
  pixels.resize(board.points().size());
  for (std::size_t k = 0; k < pixels.size(); ++k) {
    const RivalBoard::Point& point = board.points()[k];
    const double u = point.uv.x(), v = point.uv.y();
    Vec3 p_K(point.xy.x() + extra[kStretch] * u + extra[kSkew] * v, point.xy.y(),
             (shared[kBowX] + extra[kBendX]) * u * u + (shared[kBowY] + extra[kBendY]) * v * v +
                 (shared[kBowXY] + extra[kBendXY]) * u * v);
    p_K += extra.segment<3>(kOffsetX);
    if (shaped) p_K.z() += extra.segment<kHeightTerms>(kHeight).dot(point.height);
    if (printed) {
      p_K.x() += extra.segment<kPrintTerms>(kPrintX).dot(point.print);
      p_K.y() += extra.segment<kPrintTerms>(kPrintY).dot(point.print);
    }
    if (freed && k < kMaxFreePoints)
      p_K += extra.segment<3>(kFree + 3 * static_cast<Eigen::Index>(k));
    Vec3 p_C = X_CK * p_K;
    if (moves) {
      const double when = rows_px[k] / size.height - 0.5;
      p_C += when * (velocity + spin.cross(Vec3(X_CK.R * (p_K - centre))));
    }
    p_C = ThroughGlass(extra, normal, p_C);
    if (!(p_C.z() > kMinDepth_m)) return false;
    pixels[k] = RivalPixelOf(fisheye, shared, extra, p_C);
    if (!pixels[k].allFinite()) return false;
  }
  return true;
}

lens::Lens LensOfRival(bool fisheye, const SharedVector& shared, const ExtraVector& extra) {
  lens::Lens lens = LensFromShared(shared);
  lens.fisheye = fisheye;
  if (fisheye) lens.p1 = lens.p2 = 0;
  lens.k4 = extra[kK4];
  if (fisheye) return lens;
  lens.k5 = extra[kK5], lens.k6 = extra[kK6];
  lens.s1 = extra[kPrism1], lens.s2 = extra[kPrism2];
  lens.s3 = extra[kPrism3], lens.s4 = extra[kPrism4];
  return lens;
}

ExtraVector ExtraDeviations(const RivalBoard& board, image::ImageSize size) {
  const double half_m = board.half_m();
  ExtraVector sd = ExtraVector::Constant(0.3);  // of distortion
  sd[kZoom] = 0.1;
  sd[kShiftX] = sd[kShiftY] = 0.05 * size.width;
  sd[kBendX] = sd[kBendY] = sd[kBendXY] = 0.05 / half_m;
  sd.segment<3>(kVelocityX).setConstant(0.05 * half_m);
  sd[kVelocityZ] = 0.2 * half_m;
  sd.segment<3>(kSpinX).setConstant(0.05);
  sd[kStretch] = sd[kSkew] = 0.1;
  sd[kPaneX] = sd[kPaneY] = sd[kPaneZ] = 0.02;
  sd[kBoardGlass] = 0.01;
  sd.segment<4>(kPrism1).setConstant(0.05);
  sd.segment<3>(kOffsetX).setConstant(0.05 * half_m);
  sd.segment<kHeightTerms>(kHeight).setConstant(0.05 * half_m);
  sd.segment<2 * kPrintTerms>(kPrintX).setConstant(0.02 * half_m);
  sd.segment<3 * kMaxFreePoints>(kFree).setConstant(0.02 * half_m);
  return sd;
}

}  // namespace plumbline::vision
