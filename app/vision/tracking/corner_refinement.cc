#include "app/vision/tracking/corner_refinement.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "firmware-like/image/luma_view.h"
#include "firmware-like/lens/lens.h"

namespace plumbline::vision {
namespace {

// Fit of one straight dark-to-bright edge to the surrounding grey levels.

/// Approximate position of an edge. Its bright outside is to the left when going from start to end
/// as seen in the image (v downwards).
struct EdgeRegion {
  lens::Vec2 start, end;     ///< corners [px], accurate to about half a pixel
  lens::Vec2 before, after;  ///< outward unit normals of the adjacent sides at start and end
  double cell_px = 0;        ///< width of the dark zone inside and of the bright zone outside
  double bow_px = 0;         ///< outward deflection of the edge at its middle
  HiddenParts hidden;        ///< not to be used
};

/// Fitted edge; d0 and d1 are its outward distances from start and end.
struct EdgeFit {
  double d0 = 0, d1 = 0;       ///< [px]
  Eigen::Matrix2d covariance;  ///< of (d0, d1), from the residuals [px^2]
  double blur_px = 0;          ///< standard deviation of the blur
  double noise = 0;            ///< standard deviation of the residuals [grey levels]
};

constexpr int kParameters = 7;           // d0, d1, log sigma, B, b, A, a
constexpr std::size_t kMinSamples = 12;  // three for each of d0, d1, B, A
constexpr std::size_t kFewSamples = 36;  // below, the other parameters are tied to typical values
constexpr double kLogBlurSd = 0.3;       // of log sigma about that of kTypicalBlur_px
constexpr double kSlopeSd = 0.1;         // of the slopes b and a, as a share of A
constexpr int kMaxSteps = 6;
constexpr double kConverged_px = 2e-3;
constexpr double kTypicalBlur_px = 0.9;
constexpr double kReach = 3.9, kCornerMargin = 2.9;  // in standard deviations of the blur
constexpr double kOtherEdgesMargin = 1.7;            // likewise, from the far side of the cell
constexpr double kMinReach_px = 1.6;                 // smallest reach, for narrow cells
constexpr double kReselectRatio =
    1.15;  // blur / assumed blur above which the pixels are reselected
constexpr double kMaxShift_px = 2;
constexpr double kMinGrey = 1, kMaxGrey = 254;  // [grey levels] saturation limits

using Normal = Eigen::Matrix<double, kParameters, kParameters>;
using Parameters = Eigen::Matrix<double, kParameters, 1>;

/// Normal distribution function Phi and density phi from a table, accurate to 2e-6.
class Gauss {
 public:
  Gauss() {
    for (int i = 0; i <= kCount; ++i) {
      const double x = (i - kMiddle) / kPerUnit;
      phi_[i] = std::exp(-0.5 * x * x) / std::sqrt(2 * std::numbers::pi);
      Phi_[i] = 0.5 * std::erfc(-x / std::numbers::sqrt2);
    }
  }
  void At(double x, double& Phi, double& phi) const {
    const double at = std::clamp(x * kPerUnit + kMiddle, 0.0, kCount - 1e-6);
    const int i = static_cast<int>(at);
    const double a = at - i;
    Phi = Phi_[i] + a * (Phi_[i + 1] - Phi_[i]);
    phi = phi_[i] + a * (phi_[i + 1] - phi_[i]);
  }

 private:
  static constexpr int kMiddle = 640, kCount = 2 * kMiddle;
  static constexpr double kPerUnit = 128;
  std::array<double, kCount + 1> Phi_, phi_;
};

struct Sample {
  double d, s, grey;  ///< outward distance from the bowed chord [px]; along it (1); grey level
};

void CollectSamples(const image::LumaView& image, const EdgeRegion& region, double reach,
                    double from_corner, std::vector<Sample>& samples) {
  const lens::Vec2 side = region.end - region.start;
  const double length = side.norm();
  const lens::Vec2 t = side / length, n(t.y(), -t.x());
  samples.clear();
  // Scan rows or columns, whichever crosses the edge more steeply.
  const bool by_columns = std::abs(t.x()) > std::abs(t.y());
  const int main = by_columns ? 0 : 1, other = 1 - main;
  const int most[2] = {image.width - 1, image.height - 1};
  const double low = std::min(region.start[main], region.end[main]);
  const double high = std::max(region.start[main], region.end[main]);
  const double across = reach / std::abs(n[other]);
  const int first = std::max(0, static_cast<int>(std::ceil(low - reach)));
  const int last = std::min(most[main], static_cast<int>(std::floor(high + reach)));
  for (int i = first; i <= last; ++i) {
    const double at = region.start[other] + (i - region.start[main]) * t[other] / t[main];
    const int from =
        std::max(0, static_cast<int>(std::ceil(at - across - std::abs(region.bow_px))));
    const int to =
        std::min(most[other], static_cast<int>(std::floor(at + across + std::abs(region.bow_px))));
    for (int j = from; j <= to; ++j) {
      lens::Vec2 p;
      p[main] = i, p[other] = j;
      const lens::Vec2 x = p - region.start;
      const double along = t.dot(x), s = along / length;
      if (-region.before.dot(x) < from_corner || -region.after.dot(p - region.end) < from_corner)
        continue;
      if (region.hidden.Hides(s)) continue;
      const double d = n.dot(x) - 4 * region.bow_px * s * (1 - s);
      if (std::abs(d) > reach) continue;
      const int u = by_columns ? i : j, v = by_columns ? j : i;
      samples.push_back({d, s, static_cast<double>(image.row(v)[u])});
    }
  }
}

/// Initial grey levels far inside and far outside.
void InitializeLevels(const std::vector<Sample>& samples, double reach, Parameters& x) {
  double dark = 0, bright = 0;
  int darks = 0, brights = 0;
  for (const Sample& sample : samples) {
    if (sample.d < -0.5 * reach) dark += sample.grey, ++darks;
    if (sample.d > 0.5 * reach) bright += sample.grey, ++brights;
  }
  x[3] = darks > 0 ? dark / darks : 0;
  x[5] = (brights > 0 ? bright / brights : 255) - x[3];
}

struct Sum {
  double squares = 0;
  int count = 0;
};

Sum Accumulate(const std::vector<Sample>& samples, const Parameters& x, Normal& JtJ,
               Parameters& Jtr) {
  static const Gauss gauss;
  const double inverse = std::exp(-x[2]);
  JtJ.setZero();
  Jtr.setZero();
  Sum sum;
  for (const Sample& sample : samples) {
    const double s = sample.s;
    const double scaled = (sample.d - x[0] * (1 - s) - x[1] * s) * inverse;
    double Phi = 0, phi = 0;
    gauss.At(scaled, Phi, phi);
    const double height = x[5] + x[6] * s;
    const double model = x[3] + x[4] * s + height * Phi;
    // A saturated pixel only bounds the light.
    if ((sample.grey <= kMinGrey && model <= kMinGrey) ||
        (sample.grey >= kMaxGrey && model >= kMaxGrey)) {
      continue;
    }
    const double residual = sample.grey - model;
    const double slope =
        -height * phi * inverse;  // derivative of the grey level with respect to d0 + d1
    const double row[kParameters] = {slope * (1 - s), slope * s, -height * phi * scaled, 1, s, Phi,
                                     Phi * s};
    for (int i = 0; i < kParameters; ++i) {
      for (int j = 0; j <= i; ++j) JtJ(i, j) += row[i] * row[j];
      Jtr[i] += row[i] * residual;
    }
    sum.squares += residual * residual;
    ++sum.count;
  }
  return sum;
}

/// Ties log sigma, b and a to their typical values, weighted by the noise of the grey levels.
void AddPrior(const Sum& sum, const Parameters& x, Normal& JtJ, Parameters& Jtr) {
  const double variance = std::max(1.0, sum.squares / std::max(1, sum.count));
  const double slope_sd = kSlopeSd * std::max(1.0, std::abs(x[5]));
  const auto tie = [&](int i, double value, double sd) {
    const double weight = variance / (sd * sd);
    JtJ(i, i) += weight;
    Jtr[i] += weight * (value - x[i]);
  };
  tie(2, std::log(kTypicalBlur_px), kLogBlurSd);
  tie(4, 0, slope_sd);
  tie(6, 0, slope_sd);
}

/// Fits one selection of pixels. @param x  initial values on input, the solution on output
std::optional<EdgeFit> FitSamples(const std::vector<Sample>& samples, Parameters& x) {
  if (samples.size() < kMinSamples) return std::nullopt;
  Normal JtJ;
  Parameters Jtr;
  Sum sum;
  for (int step = 0; step < kMaxSteps; ++step) {
    sum = Accumulate(samples, x, JtJ, Jtr);
    if (samples.size() < kFewSamples) AddPrior(sum, x, JtJ, Jtr);
    // Weak prior on blur and slopes, in case the pixels do not determine them.
    const double held = 1e-6 * JtJ.diagonal().maxCoeff();
    for (int i = 0; i < kParameters; ++i) JtJ(i, i) += held;
    const Parameters change = JtJ.selfadjointView<Eigen::Lower>().ldlt().solve(Jtr);
    if (!change.allFinite()) return std::nullopt;
    x += change;
    x[2] = std::clamp(x[2], std::log(0.25), std::log(4.0));
    if (!(std::abs(x[0]) < kMaxShift_px && std::abs(x[1]) < kMaxShift_px)) return std::nullopt;
    if (std::abs(change[0]) < kConverged_px && std::abs(change[1]) < kConverged_px) break;
  }
  if (!(x[5] + 0.5 * x[6] > 0) || sum.count < static_cast<int>(kMinSamples)) return std::nullopt;
  const double variance = sum.squares / std::max(1, sum.count - kParameters);
  const Normal covariance =
      variance * JtJ.selfadjointView<Eigen::Lower>().ldlt().solve(Normal::Identity());
  return EdgeFit{x[0], x[1], covariance.topLeftCorner<2, 2>(), std::exp(x[2]), std::sqrt(variance)};
}

/// See corner_refinement.h for the model. Pixels closer to an adjacent side than three times the
/// blur are excluded.
std::optional<EdgeFit> FitEdge(const image::LumaView& image, const EdgeRegion& region) {
  const double length = (region.end - region.start).norm();
  static thread_local std::vector<Sample> samples;
  Parameters x = Parameters::Zero();
  x[2] = std::log(kTypicalBlur_px);
  double blur = kTypicalBlur_px;
  for (;;) {
    const double reach =
        std::max(kMinReach_px, std::min(kReach * blur, region.cell_px - kOtherEdgesMargin * blur));
    CollectSamples(image, region, reach, std::min(kCornerMargin * blur, 0.2 * length), samples);
    if (blur == kTypicalBlur_px) InitializeLevels(samples, reach, x);
    auto fit = FitSamples(samples, x);
    if (!fit || blur > kTypicalBlur_px || fit->blur_px < kReselectRatio * blur) return fit;
    blur = fit->blur_px;
  }
}

/// Outward deflection of the image of a straight side at its middle [px].
double BowAtMiddle(const lens::Lens& lens, const lens::Vec2& from, const lens::Vec2& to,
                   const lens::Vec2& normal) {
  const auto a = lens::NormalisedOfPixel(lens, from), b = lens::NormalisedOfPixel(lens, to);
  if (!a || !b) return 0;
  // Evaluated near the middle, where a displacement along the side does not matter.
  return normal.dot(lens::PixelOfNormalised<double>(lens, 0.5 * (*a + *b)) - 0.5 * (from + to));
}

}  // namespace

std::optional<RefinedCorners> RefineCorners(const image::LumaView& image, const Corners& rough,
                                            const std::array<HiddenParts, 4>& hidden, int cells,
                                            const lens::Lens* lens) {
  std::array<EdgeFit, 4> fits;
  std::array<lens::Vec2, 4> direction, normal;
  std::array<double, 4> length{};
  RefinedCorners refined;
  for (Eigen::Index k = 0; k < 4; ++k) {
    const lens::Vec2 side = rough[(k + 1) % 4] - rough[k];
    length[k] = side.norm();
    if (!(length[k] > 4)) return std::nullopt;
    direction[k] = side / length[k];
    normal[k] = lens::Vec2(direction[k].y(), -direction[k].x());
  }
  for (Eigen::Index k = 0; k < 4; ++k) {
    // Cell size across this side, at the narrower end of the tag.
    const double across = std::min(-normal[k].dot(rough[(k + 2) % 4] - rough[k]),
                                   -normal[k].dot(rough[(k + 3) % 4] - rough[k]));
    EdgeRegion region{
        rough[k], rough[(k + 1) % 4], normal[(k + 3) % 4], normal[(k + 1) % 4], across / cells,
        0,        hidden[k]};
    if (lens != nullptr) {
      region.bow_px = BowAtMiddle(*lens, rough[k], rough[(k + 1) % 4], normal[k]);
    }
    const auto fit = FitEdge(image, region);
    if (!fit) return std::nullopt;
    fits[k] = *fit;
    refined.blur_px += 0.25 * fit->blur_px;
  }
  refined.covariance.setZero();
  for (Eigen::Index k = 0; k < 4; ++k) {
    // n . x = d0 + (d1 - d0) s for both sides, with x relative to the rough corner:
    // s = 1 + t . x / length at the end of the previous side, s = t . x / length at the start of
    // the next side.
    const Eigen::Index before = (k + 3) % 4;
    const EdgeFit &b = fits[before], &a = fits[k];
    Eigen::Matrix2d N;
    N.row(0) = normal[before] - (b.d1 - b.d0) / length[before] * direction[before];
    N.row(1) = normal[k] - (a.d1 - a.d0) / length[k] * direction[k];
    if (std::abs(N.determinant()) < 0.1) return std::nullopt;
    const Eigen::Matrix2d inverse = N.inverse();
    refined.corners[k] = rough[k] + inverse * lens::Vec2(b.d1, a.d0);
    // The end of side k determines corner k + 1, its start corner k.
    const lens::Vec2 by_start = inverse.col(1), by_end_of_before = inverse.col(0);
    const Eigen::Index next = (k + 1) % 4;
    refined.covariance.block<2, 2>(2 * k, 2 * k) +=
        by_start * a.covariance(0, 0) * by_start.transpose() +
        by_end_of_before * b.covariance(1, 1) * by_end_of_before.transpose();
    Eigen::Matrix2d N_next;
    N_next.row(0) = normal[k] - (a.d1 - a.d0) / length[k] * direction[k];
    N_next.row(1) = normal[next] - (fits[next].d1 - fits[next].d0) / length[next] * direction[next];
    const lens::Vec2 by_end = N_next.inverse().col(0);
    const Eigen::Matrix2d shared = by_start * a.covariance(0, 1) * by_end.transpose();
    refined.covariance.block<2, 2>(2 * k, 2 * next) += shared;
    refined.covariance.block<2, 2>(2 * next, 2 * k) += shared.transpose();
  }
  return refined;
}

}  // namespace plumbline::vision
