#include "app/vision/lens/saddle_points.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace plumbline::vision {
namespace {

constexpr int kNeighbourhood = 3;  // half width of the window for local maxima
constexpr double kMinRelativeStrength = 0.02;
constexpr double kMinStrength = 0.3;  // grey levels^2 / px^4; noise of 3 levels gives 0.1
constexpr int kRingSamples = 32;      // samples; even
constexpr double kMaxAsymmetry =
    0.45;  // share of the ring that may differ from its point reflection

cv::Mat StrengthOf(const cv::Mat& smooth) {
  cv::Mat strength = cv::Mat::zeros(smooth.size(), CV_32F);
  for (int v = 1; v + 1 < smooth.rows; ++v) {
    const float* above = smooth.ptr<float>(v - 1);
    const float* here = smooth.ptr<float>(v);
    const float* below = smooth.ptr<float>(v + 1);
    float* out = strength.ptr<float>(v);
    for (int u = 1; u + 1 < smooth.cols; ++u) {
      const float xx = here[u - 1] - 2 * here[u] + here[u + 1];
      const float yy = above[u] - 2 * here[u] + below[u];
      const float xy = 0.25F * (above[u - 1] - above[u + 1] - below[u - 1] + below[u + 1]);
      out[u] = xy * xy - xx * yy;
    }
  }
  return strength;
}

bool IsMaximum(const cv::Mat& strength, int u, int v) {
  const float here = strength.at<float>(v, u);
  for (int j = -kNeighbourhood; j <= kNeighbourhood; ++j) {
    const float* row = strength.ptr<float>(v + j);
    for (int i = -kNeighbourhood; i <= kNeighbourhood; ++i) {
      // Of equal neighbours, the first one is the maximum.
      if (row[u + i] > here || (row[u + i] == here && (j < 0 || (j == 0 && i < 0)))) return false;
    }
  }
  return true;
}

double Bilinear(const cv::Mat& image, double x, double y) {
  const int u = static_cast<int>(x), v = static_cast<int>(y);
  const double a = x - u, b = y - v;
  const float* top = image.ptr<float>(v) + u;
  const float* bottom = image.ptr<float>(v + 1) + u;
  return (1 - b) * ((1 - a) * top[0] + a * top[1]) + b * ((1 - a) * bottom[0] + a * bottom[1]);
}

/// Sub-pixel position: where the gradient of the fitted quadric is zero.
lens::Vec2 RefineSubpixel(const cv::Mat& smooth, int u, int v) {
  const float* above = smooth.ptr<float>(v - 1);
  const float* here = smooth.ptr<float>(v);
  const float* below = smooth.ptr<float>(v + 1);
  Eigen::Matrix2d H;
  H(0, 0) = here[u - 1] - 2 * here[u] + here[u + 1];
  H(1, 1) = above[u] - 2 * here[u] + below[u];
  H(0, 1) = H(1, 0) = 0.25 * (above[u - 1] - above[u + 1] - below[u - 1] + below[u + 1]);
  const lens::Vec2 g(0.5 * (here[u + 1] - here[u - 1]), 0.5 * (below[u] - above[u]));
  const lens::Vec2 step = -H.inverse() * g;
  return lens::Vec2(u, v) + (step.norm() < 1.5 ? step : lens::Vec2::Zero());
}

/// Directions of the edges on a ring around the point; nullopt if four squares do not meet there.
std::optional<std::array<double, 2>> EdgesAround(const cv::Mat& smooth, const lens::Vec2& at,
                                                 double radius) {
  static const std::array<lens::Vec2, kRingSamples> kDirections = [] {
    std::array<lens::Vec2, kRingSamples> directions;
    for (int k = 0; k < kRingSamples; ++k) {
      const double angle = 2 * std::numbers::pi * k / kRingSamples;
      directions[k] = {std::cos(angle), std::sin(angle)};
    }
    return directions;
  }();
  if (at.x() < radius + 1 || at.y() < radius + 1 || at.x() > smooth.cols - radius - 3 ||
      at.y() > smooth.rows - radius - 3)
    return std::nullopt;
  std::array<double, kRingSamples> ring;
  double mean = 0;
  for (int k = 0; k < kRingSamples; ++k) {
    const lens::Vec2 p = at + radius * kDirections[k];
    ring[k] = Bilinear(smooth, p.x(), p.y());
    mean += ring[k] / kRingSamples;
  }
  double size = 0, asymmetry = 0;
  for (int k = 0; k < kRingSamples; ++k) {
    ring[k] -= mean;
    size += std::abs(ring[k]);
  }
  // Opposite samples are added, so that a brightness gradient across the corner cancels.
  std::array<double, kRingSamples / 2> half;
  for (int k = 0; k < kRingSamples / 2; ++k) {
    asymmetry += std::abs(ring[k] - ring[k + kRingSamples / 2]);
    half[k] = ring[k] + ring[k + kRingSamples / 2];
  }
  if (asymmetry > kMaxAsymmetry * size) return std::nullopt;
  int crossings = 0;
  std::array<double, 2> edges = {0, 0};
  for (int k = 0; k < kRingSamples / 2; ++k) {
    const double next = half[(k + 1) % (kRingSamples / 2)];
    if ((half[k] > 0) == (next > 0)) continue;
    if (++crossings > 2) return std::nullopt;
    const double angle = 2 * std::numbers::pi / kRingSamples * (k + half[k] / (half[k] - next));
    edges[next > 0 ? 0 : 1] = std::fmod(angle, std::numbers::pi);
  }
  if (crossings != 2) return std::nullopt;
  return edges;
}

}  // namespace

std::vector<SaddlePoint> FindSaddlePoints(const cv::Mat& smooth, double radius, std::size_t most) {
  const cv::Mat strength = StrengthOf(smooth);
  double strongest = 0;
  cv::minMaxLoc(strength, nullptr, &strongest);
  const float least = static_cast<float>(std::max(kMinStrength, kMinRelativeStrength * strongest));
  struct Peak {
    float strength;
    int u, v;
  };
  std::vector<Peak> peaks;
  for (int v = kNeighbourhood; v + kNeighbourhood < strength.rows; ++v) {
    const float* row = strength.ptr<float>(v);
    for (int u = kNeighbourhood; u + kNeighbourhood < strength.cols; ++u) {
      if (row[u] > least && row[u] >= row[u - 1] && row[u] >= row[u + 1] &&
          IsMaximum(strength, u, v)) {
        peaks.push_back({row[u], u, v});
      }
    }
  }
  std::ranges::stable_sort(peaks,
                           [](const Peak& a, const Peak& b) { return a.strength > b.strength; });
  if (peaks.size() > most) peaks.resize(most);
  std::vector<SaddlePoint> points;
  for (const Peak& peak : peaks) {
    const lens::Vec2 at = RefineSubpixel(smooth, peak.u, peak.v);
    if (const auto edges = EdgesAround(smooth, at, radius))
      points.push_back({at, *edges, peak.strength});
  }
  return points;
}

}  // namespace plumbline::vision
