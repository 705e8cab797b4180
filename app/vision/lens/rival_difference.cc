#include "app/vision/lens/rival_difference.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "app/vision/lens/projection_uncertainty.h"

namespace plumbline::vision {
namespace {

constexpr int kGridColumns = 9, kGridRows = 7;
constexpr int kMaxPasses = 6;

/// A pixel with its viewing direction.
struct Sample {
  lens::Vec2 pixel;
  Vec3 direction;
};

/// Difference of the lens with these extra parameters [px].
double DifferenceOf(const std::vector<Sample>& samples, bool fisheye, const SharedVector& shared,
                    const ExtraVector& extra) {
  constexpr double kStep = 1e-6;
  Mat3 R = Mat3::Identity();
  double largest = 0;
  for (int pass = 0; pass < kMaxPasses; ++pass) {
    Mat3 square = Mat3::Zero();
    Vec3 mixed = Vec3::Zero();
    largest = 0;
    for (const Sample& sample : samples) {
      const Vec3 d = R * sample.direction;
      if (!(d.z() > 0)) return INFINITY;
      const lens::Vec2 at = RivalPixelOf(fisheye, shared, extra, d), error = at - sample.pixel;
      largest = std::max(largest, error.norm());
      Eigen::Matrix<double, 2, 3> J;
      for (int axis = 0; axis < 3; ++axis) {
        const Vec3 turned = d + kStep * Vec3::Unit(axis).cross(d);
        J.col(axis) = (RivalPixelOf(fisheye, shared, extra, turned) - at) / kStep;
      }
      square += J.transpose() * J;
      mixed += J.transpose() * error;
    }
    const Vec3 w = -square.ldlt().solve(mixed);
    if (!w.allFinite()) return INFINITY;
    if (w.norm() < 1e-7) break;
    R = Eigen::AngleAxisd(w.norm(), w.normalized()).toRotationMatrix() * R;
  }
  return largest;
}

double LargestOverViews(const std::vector<Sample>& samples, const Rival& rival,
                        const RivalResult& result) {
  ExtraVector extra = result.extra;
  for (const int k : rival.changing) extra[k] = 0;  // at the last view
  double largest = DifferenceOf(samples, rival.fisheye, result.shared, extra);
  if (rival.local.empty()) return largest;
  for (const ExtraVector& of_view : result.local) {
    largest =
        std::max(largest, DifferenceOf(samples, rival.fisheye, result.shared, extra + of_view));
  }
  return largest;
}

}  // namespace

RadiusErrors LensDifferences(const lens::Lens& lens, const Rival& rival, const RivalResult& result,
                             image::ImageSize size) {
  RadiusErrors errors{};
  for (std::size_t k = 0; k < errors.size(); ++k) {
    std::vector<Sample> samples;
    bool all = true;
    for (const lens::Vec2& pixel :
         PixelsWithin(size, CandidateRadius(k, size), kGridColumns, kGridRows)) {
      const auto n = lens::NormalisedOfPixel(lens, pixel);
      if (n) samples.push_back({pixel, Vec3(n->x(), n->y(), 1).normalized()});
      all &= n.has_value();
    }
    errors[k] = all ? LargestOverViews(samples, rival, result) : INFINITY;
  }
  return errors;
}

}  // namespace plumbline::vision
