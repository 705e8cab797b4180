// Images without tags that have the statistics of photographs.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace plumbline::test {

/// One object of a natural image: a disc or a rotated rectangle, plain, textured or with random
/// cells inside a dark border.
struct Leaf {
  double u, v, radius, cos_turn, sin_turn, aspect, grey, texture, frequency;
  bool disc, cells;
  std::uint64_t code;

  explicit Leaf(std::mt19937_64& random, int width, int height) {
    std::uniform_real_distribution<double> uniform(0, 1);
    // Density of the radius proportional to its -3rd power.
    radius = std::min(3 / std::sqrt(uniform(random) + 1e-5), 360.0);
    u = uniform(random) * width;
    v = uniform(random) * height;
    const double turn = random() % 2 == 0 ? 0 : 6.283 * uniform(random);
    cos_turn = std::cos(turn), sin_turn = std::sin(turn);
    aspect = 0.4 + 0.6 * uniform(random);
    grey = 255 * uniform(random);
    texture = 30 * uniform(random);
    frequency = 0.1 + uniform(random);
    disc = random() % 4 == 0;
    cells = !disc && random() % 3 == 0;
    code = random();
  }
  void Paint(std::vector<float>& image, int width, int height) const {
    const int reach = static_cast<int>(1.5 * radius) + 1;
    const int u0 = static_cast<int>(u), v0 = static_cast<int>(v);
    for (int y = std::max(0, v0 - reach); y < std::min(height, v0 + reach); ++y) {
      for (int x = std::max(0, u0 - reach); x < std::min(width, u0 + reach); ++x) {
        const double a = (cos_turn * (x - u) + sin_turn * (y - v)) / radius;
        const double b = (cos_turn * (y - v) - sin_turn * (x - u)) / radius / aspect;
        if (disc ? a * a + b * b > 1 : std::max(std::abs(a), std::abs(b)) > 1) continue;
        double level = grey + texture * std::sin(frequency * x + 0.3 * y) * std::sin(frequency * y);
        if (cells) {
          const int column = static_cast<int>((a + 1) * 4), row = static_cast<int>((b + 1) * 4);
          const bool inner = std::max(std::abs(a), std::abs(b)) < 0.75;
          level = inner && ((code >> ((8 * row + column) & 63)) & 1) != 0 ? grey + 90 : grey;
        }
        image[static_cast<std::size_t>(y) * width + x] = static_cast<float>(level);
      }
    }
  }
};

/// "Dead leaves": objects of all sizes that occlude each other, blurred, with noise. Its spectrum
/// and edges resemble those of photographs [A. Lee, D. Mumford, J. Huang, Occlusion models for
/// natural images, Int. J. Computer Vision 41, 2001].
inline std::vector<std::uint8_t> NaturalImage(int width, int height, int objects,
                                              std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<float> sharp(static_cast<std::size_t>(width) * height, 128);
  for (int k = 0; k < objects; ++k) Leaf(random, width, height).Paint(sharp, width, height);
  std::normal_distribution<float> noise(0, 2.5F);
  std::vector<std::uint8_t> image(sharp.size());
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      float sum = 0;
      for (int j = -1; j <= 1; ++j) {
        const float* const row =
            &sharp[static_cast<std::size_t>(std::clamp(y + j, 0, height - 1)) * width];
        const float weight = j == 0 ? 2 : 1;
        sum += weight * (row[std::max(x - 1, 0)] + 2 * row[x] + row[std::min(x + 1, width - 1)]);
      }
      image[static_cast<std::size_t>(y) * width + x] =
          static_cast<std::uint8_t>(std::clamp(sum / 16 + noise(random), 0.0F, 255.0F));
    }
  }
  return image;
}

}  // namespace plumbline::test
