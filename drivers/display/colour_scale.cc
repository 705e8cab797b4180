#include "drivers/display/colour_scale.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace plumbline::display {
namespace {

/// Converts Oklab to linear sRGB.
Vec3 LinearOfOklab(double lightness, double a, double b) {
  const Mat3 cone_of_lab{{1, 0.3963377774, 0.2158037573},
                         {1, -0.1055613458, -0.0638541728},
                         {1, -0.0894841775, -1.2914855480}};
  const Mat3 linear_of_cone{{4.0767416621, -3.3077115913, 0.2309699292},
                            {-1.2684380046, 2.6097574011, -0.3413193965},
                            {-0.0041960863, -0.7034186147, 1.7076147010}};
  const Vec3 cone = cone_of_lab * Vec3(lightness, a, b);
  return linear_of_cone * cone.cwiseProduct(cone).cwiseProduct(cone);
}

float EncodedSrgb(double linear) {
  const double c = std::clamp(linear, 0.0, 1.0);
  return static_cast<float>(c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055);
}

}  // namespace

scene::Colour StressColour(double fraction) {
  const double t = fraction > 0 ? std::min(fraction, 1.0) : 0.0;
  const double lightness = 0.30 + 0.63 * t;
  const double hue = (285 - 180 * t) * std::numbers::pi / 180;
  Vec3 linear = Vec3::Zero();
  for (int step = 65; step > 0; --step) {
    const double chroma = 0.002 * step;
    linear = LinearOfOklab(lightness, chroma * std::cos(hue), chroma * std::sin(hue));
    if (linear.minCoeff() >= 0 && linear.maxCoeff() <= 1) break;
  }
  return {EncodedSrgb(linear.x()), EncodedSrgb(linear.y()), EncodedSrgb(linear.z()), 1};
}

}  // namespace plumbline::display
