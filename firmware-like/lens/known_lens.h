// Lens parameters with their covariance.
#pragma once

#include <limits>
#include <string_view>
#include <vector>

#include "firmware-like/image/image_size.h"
#include "firmware-like/lens/lens.h"

namespace plumbline::lens {

/// Number of lens parameters, in the order of Lens: fx, fy, cx, cy [px], k1, k2, p1, p2, k3, k4,
/// k5, k6, s1, s2, s3, s4 (1).
inline constexpr int kLensParameters = 16;
/// The first ones are the usual five-coefficient lens (k1, k2, p1, p2, k3); of the others, those
/// that the model of a lens lacks are zero, with zero covariance.
inline constexpr int kUsualParameters = 9;
using LensVector = Eigen::Matrix<double, kLensParameters, 1>;
using LensCovariance = Eigen::Matrix<double, kLensParameters, kLensParameters>;

/// Names of the parameters in files.
inline constexpr const char* kLensParameterNames[kLensParameters] = {
    "fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4"};

LensVector VectorOfLens(const Lens& lens);
/// @param fisheye  see Lens
Lens LensOfVector(const LensVector& values, bool fisheye = false);

/// Kinds of distortion model, from the parameters that are not zero.
enum class LensModel { kUsual, kRational, kThinPrism, kFisheye };
LensModel ModelOf(const Lens& lens);
/// "brown", "rational", "thin prism" or "fisheye", as in the files.
std::string_view ModelName(LensModel model);
/// The coefficients in OpenCV's order: k1, k2, p1, p2, k3; for a rational lens also k4, k5, k6,
/// with thin prism also s1..s4; for a fisheye k1..k4.
std::vector<double> DistortionOf(const Lens& lens);
/// Sets the coefficients of a lens from OpenCV's order.
/// @return  false if their number is not that of a model
bool SetDistortion(const std::vector<double>& values, bool fisheye, Lens& lens);

/// Derivative of a pixel with respect to the lens parameters [px per unit].
Eigen::Matrix<double, 2, kLensParameters> PixelByLens(const Lens& lens, const Vec2& normalised);

struct KnownLens {
  Lens lens;
  LensCovariance covariance = LensCovariance::Zero();  ///< in the order of LensVector
  image::ImageSize size{};  ///< size of the calibration images; 0 x 0 if unknown
  /// Usable region: the lens is trusted up to this distance from the middle of the image [px].
  double usable_radius_px = std::numeric_limits<double>::infinity();  ///< infinite: everywhere
};

/// Middle of an image: between the centres of its outermost pixels [px].
inline Vec2 MiddleOf(image::ImageSize size) {
  return {0.5 * (size.width - 1), 0.5 * (size.height - 1)};
}

/// Whether nothing in the image lies outside the lens's usable region.
inline bool UsableEverywhere(const KnownLens& lens) {
  return lens.usable_radius_px >= MiddleOf(lens.size).norm();
}

/// Whether a pixel lies in the lens's usable region.
inline bool UsableAt(const KnownLens& lens, const Vec2& pixel) {
  return lens.usable_radius_px == std::numeric_limits<double>::infinity() ||
         (pixel - MiddleOf(lens.size)).norm() <= lens.usable_radius_px;
}

/// Share of the image that lies in the usable region, by counting cells (1).
double UsableShare(const KnownLens& lens);

}  // namespace plumbline::lens
