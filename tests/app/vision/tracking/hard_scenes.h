// Rendered tags that are hard to detect: shadows, defocus, thin margins, neighbours, little
// contrast.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "tests/app/vision/tracking/tag_scene.h"

namespace plumbline::test {

enum class Difficulty { kShadow, kDefocus, kThinMargin, kTouched, kLittleContrast };

struct NamedDifficulty {
  Difficulty kind;
  const char* name;
};
inline constexpr std::array<NamedDifficulty, 5> kDifficulties = {{
    {Difficulty::kShadow, "a shadow's edge across it"},
    {Difficulty::kDefocus, "defocus"},
    {Difficulty::kThinMargin, "a thin margin"},
    {Difficulty::kTouched, "dark things at its border"},
    {Difficulty::kLittleContrast, "little contrast in a part"},
}};

/// One tag in an image of 640 x 480 pixels.
struct HardScene {
  renderer::Image image;
  int id = 0;
  vision::Corners corners;  ///< the truth [px]
};

namespace internal {

/// Multiplies the light by `shade` on one side of a line, with a penumbra, and adds veiling glare.
struct Light {
  double nu = 1, nv = 0, at = 0;  ///< the line nu u + nv v = at [px]
  double shade = 1;               ///< light on the far side
  double penumbra_px = 0.1;       ///< standard deviation of the transition
  double glare = 0;               ///< [grey levels]

  double At(double grey, double u, double v) const {
    const double d = (nu * u + nv * v - at) / penumbra_px;
    const double lit = 0.5 * std::erfc(d / std::numbers::sqrt2);
    return glare + grey * (shade + (1 - shade) * lit);
  }
};

/// Mean over a disc, the image of a point out of focus.
inline std::vector<float> Defocused(const std::vector<float>& sharp, int width, int height,
                                    double radius_px) {
  std::vector<float> blurred(sharp.size(), 0.0F);
  const int reach = static_cast<int>(std::ceil(radius_px));
  double sum = 0;
  for (int dv = -reach; dv <= reach; ++dv) {
    for (int du = -reach; du <= reach; ++du) {
      const double weight = std::clamp(radius_px + 0.5 - std::hypot(du, dv), 0.0, 1.0);
      if (weight == 0) continue;
      sum += weight;
      for (int v = 0; v < height; ++v) {
        const std::size_t to = static_cast<std::size_t>(v) * width;
        const std::size_t from =
            static_cast<std::size_t>(std::clamp(v + dv, 0, height - 1)) * width;
        for (int u = 0; u < width; ++u) {
          blurred[to + u] +=
              static_cast<float>(weight) * sharp[from + std::clamp(u + du, 0, width - 1)];
        }
      }
    }
  }
  for (float& grey : blurred) grey /= static_cast<float>(sum);
  return blurred;
}

/// A rectangle of one reflectance in the plane of the tag.
inline renderer::Sheet Patch(const Eigen::Isometry3d& X_CM, double x, double y, double half_width,
                             double half_height, double reflectance) {
  renderer::Sheet sheet;
  sheet.print = [=](double, double) { return reflectance; };
  sheet.centre_x_m = x, sheet.centre_y_m = y;
  sheet.half_width_m = half_width, sheet.half_height_m = half_height;
  sheet.X_CK = X_CM;
  return sheet;
}

/// Dark patches that touch the tag's border from outside and cover a part of its margin.
inline void AddNeighbours(const Eigen::Isometry3d& X_CM, double side_m, std::mt19937_64& random,
                          std::vector<renderer::Sheet>& sheets) {
  std::uniform_real_distribution<double> uniform(0, 1);
  const double cell = side_m / 8;
  const auto count = 1 + random() % 2;
  for (std::uint64_t k = 0; k < count; ++k) {
    const double half_width = side_m * (0.05 + 0.2 * uniform(random));
    const double half_height = cell * (0.5 + 1.5 * uniform(random));
    const double along = (side_m - half_width) * (uniform(random) - 0.5);
    const double out = 0.5 * side_m + half_height - 0.1 * cell * uniform(random);
    const double dark = 0.15 * uniform(random);
    const std::uint64_t side = random() % 4;
    const double sign = side % 2 == 0 ? 1 : -1;
    sheets.push_back(side < 2 ? Patch(X_CM, along, sign * out, half_width, half_height, dark)
                              : Patch(X_CM, sign * out, along, half_height, half_width, dark));
  }
}

}  // namespace internal

/// A tag of 36h11 of random id, pose and surroundings, with one difficulty of random degree.
inline HardScene MakeHardScene(const target::TagFamily& family, Difficulty kind,
                               std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  const auto between = [&](double low, double high) {
    return low + (high - low) * uniform(random);
  };
  TagScene tag;
  tag.camera = renderer::Pinhole(640, 480, 900);
  const bool large = kind == Difficulty::kShadow;
  const double side_px = large ? between(120, 320) : between(50, 180);
  const double depth = tag.camera.fx * tag.side_m / side_px;
  const double u = between(large ? 260 : 150, large ? 380 : 490);
  const double v = between(large ? 210 : 140, large ? 270 : 340);
  const Eigen::Isometry3d X = FacingPose(PointAt(tag.camera, u, v, depth), between(0, 0.7),
                                         between(0, 6.3), between(0, 6.3));
  tag.Add(family, static_cast<int>(random() % family.codes.size()), X);

  std::vector<renderer::Sheet> sheets;
  for (int k = 0; k < 12; ++k) {  // surroundings in the same plane
    sheets.push_back(internal::Patch(X, between(-0.4, 0.4), between(-0.4, 0.4), between(0.01, 0.1),
                                     between(0.01, 0.1), between(0, 1)));
  }
  sheets.push_back(tag.sheets[0]);
  if (kind == Difficulty::kThinMargin) {
    const double margin = between(0.15, 0.6);  // [cells]
    sheets.back().half_width_m = sheets.back().half_height_m =
        0.5 * tag.side_m * (1 + 2 * margin / family.cells());
  }
  if (kind == Difficulty::kTouched) internal::AddNeighbours(X, tag.side_m, random, sheets);

  renderer::Conditions print;
  print.black = between(8, 30);
  print.white = between(160, 240);
  print.background = between(kind == Difficulty::kThinMargin ? 10 : 40, 120);
  print.blur_px = 0;
  print.noise = 0;
  const renderer::Image plain = renderer::Render(tag.camera, sheets, print, seed);

  internal::Light light;
  const double cell_px = side_px / family.cells();
  double blur_px = between(0.5, 1.0), disc_px = 0;
  const double turn = between(0, 6.3);
  light.nu = std::cos(turn), light.nv = std::sin(turn);
  const double offset_px = side_px * between(-0.4, 0.4);
  light.at = light.nu * u + light.nv * v + offset_px;
  if (kind == Difficulty::kShadow) {
    light.shade = between(0.2, 0.6);
    light.penumbra_px = between(0.3, 6);
  } else if (kind == Difficulty::kLittleContrast) {
    light.shade = between(0.05, 0.2);
    light.penumbra_px = between(0.2, 0.6) * side_px;
    light.glare = between(0, 60);
  } else if (kind == Difficulty::kDefocus) {
    disc_px = cell_px * between(0.4, 0.9);
    blur_px = 0.5;
  }
  HardScene scene;
  scene.id = tag.ids[0];
  scene.corners = tag.corners[0];
  scene.image = plain;
  std::vector<float> grey(plain.grey.size());
  for (int row = 0; row < plain.height; ++row) {
    for (int column = 0; column < plain.width; ++column) {
      const std::size_t i = static_cast<std::size_t>(row) * plain.width + column;
      grey[i] = static_cast<float>(light.At(plain.grey[i], column, row));
    }
  }
  if (disc_px > 0) grey = internal::Defocused(grey, plain.width, plain.height, disc_px);
  grey = internal::Defocused(grey, plain.width, plain.height, 2 * blur_px);
  std::normal_distribution<float> noise(0, 2);
  for (std::size_t i = 0; i < grey.size(); ++i) {
    scene.image.grey[i] =
        static_cast<std::uint8_t>(std::clamp(grey[i] + noise(random), 0.0F, 255.0F));
  }
  return scene;
}

}  // namespace plumbline::test
