#include "app/vision/tracking/edge_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace plumbline::vision {
namespace {

constexpr std::size_t kMinSamples = 12;  // three for each of d0, d1, B, A
constexpr std::size_t kFewSamples = 36;  // below, the other parameters are tied to typical values
constexpr double kLogBlurSd = 0.3;       // of log sigma about that of kTypicalBlur_px
constexpr double kLevelSd = 0.1;         // of A and B from one end to the other, as a share of A
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

constexpr int kReweightRounds = 2;
constexpr int kMaxKnots = 8;
constexpr double kKnotDistance_px = 25;
constexpr double kKnotSd = 0.5;  // of A and B from one knot to the next, as a share of A
// Weights: residuals beyond kOutlier standard deviations count less, if there are any: the kurtosis
// of a normal distribution is 3.
constexpr double kOutlier = 2.5, kMaxKurtosis = 5;
constexpr double kMarginDrop = 0.15;    // of the step: fall of the grey level outside a thin margin
constexpr double kProfileBin_px = 0.5;  // of the mean profile across the edge
constexpr double kMinMargin_px = 0.5, kMinFlatMargin_px = 3.2;
// The blur's shape decides what of a thin margin's grey level is its width and what its brightness.
constexpr double kThinMarginSd_px = 0.2;

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
  double weight = 1;
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

/// Parameters in the order d0, d1, log sigma, C, w, then B and A at the knots.
struct Model {
  static constexpr int kShared = 5, kMost = kShared + 2 * kMaxKnots;
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMost, 1>;
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMost, kMost>;

  int knots = 2;
  bool thin_margin = false;
  Vector x;

  explicit Model(double length_px)
      : knots(std::clamp(static_cast<int>(length_px / kKnotDistance_px), 2, kMaxKnots)),
        x(Vector::Zero(kShared + 2 * knots)) {
    x[2] = std::log(kTypicalBlur_px);
  }
  double& dark(int knot) { return x[kShared + knot]; }
  double& step(int knot) { return x[kShared + knots + knot]; }
  double MeanStep() const { return x.tail(knots).mean(); }
};

/// Sets the grey levels far inside and far outside. If the margin outside is narrower than the
/// reach, drops the pixels beyond it, or lets the model have its outer edge if it is thinner still.
void InitializeLevels(std::vector<Sample>& samples, double reach, Model& model) {
  constexpr int kBins = 40;
  model.thin_margin = false;
  model.x[3] = model.x[4] = 0;
  std::array<double, kBins> sum{}, count{};  // outside
  double dark = 0, bright = 0;
  int darks = 0, brights = 0;
  for (const Sample& sample : samples) {
    if (sample.d < -0.5 * reach) dark += sample.grey, ++darks;
    if (sample.d > 0.5 * reach) bright += sample.grey, ++brights;
    const int bin = std::min(kBins - 1, static_cast<int>(sample.d / kProfileBin_px));
    if (sample.d >= 0) sum[bin] += sample.grey, count[bin] += 1;
  }
  dark = darks > 0 ? dark / darks : 0;
  bright = brights > 0 ? bright / brights : 255;
  double most = dark;
  for (int bin = 0; bin < kBins; ++bin) {
    if (count[bin] < 4) continue;
    const double grey = sum[bin] / count[bin];
    most = std::max(most, grey);
    if (most - grey <= kMarginDrop * (most - dark)) continue;
    const double end = kProfileBin_px * bin;
    if (end >= kMinFlatMargin_px) {
      std::erase_if(samples, [end](const Sample& sample) { return sample.d > end; });
    } else {
      model.thin_margin = true;
      model.x[4] = std::max(kMinMargin_px, end + kProfileBin_px);
      model.x[3] = most - bright;
    }
    bright = most;
    break;
  }
  for (int knot = 0; knot < model.knots; ++knot) {
    model.dark(knot) = dark;
    model.step(knot) = bright - dark;
  }
}

struct Sum {
  double squares = 0, fourth_powers = 0, weights = 0;
  int count = 0;

  double Variance(int parameters) const { return squares / std::max(1.0, weights - parameters); }
  double Kurtosis() const { return fourth_powers * weights / std::max(1e-9, squares * squares); }
};

/// Derivatives of the grey level with respect to d0, d1, log sigma, B and A at the two knots next
/// to the pixel, C and w; the last two only with a thin margin.
template <bool kThinMargin>
using Derivatives = std::array<double, kThinMargin ? 9 : 7>;

/// Calls work(sample, residual, knot, derivatives) for all samples but saturated ones.
template <bool kThinMargin, typename Work>
void ForResiduals(std::vector<Sample>& samples, const Model& model, const Work& work) {
  static const Gauss gauss;
  const auto& x = model.x;
  const int knots = model.knots;
  const double inverse = std::exp(-x[2]), last = knots - 1;
  const double d0 = x[0], d1 = x[1], edge = x[3], width = x[4];
  for (Sample& sample : samples) {
    const double s = sample.s;
    const int knot = std::clamp(static_cast<int>(s * last), 0, knots - 2);
    const double b = s * last - knot, a = 1 - b;
    const int dark = Model::kShared + knot, step = dark + knots;
    const double scaled = (sample.d - d0 * (1 - s) - d1 * s) * inverse;
    double Phi = 0, phi = 0;
    gauss.At(scaled, Phi, phi);
    const double height = a * x[step] + b * x[step + 1];
    double grey = a * x[dark] + b * x[dark + 1] + height * Phi;
    double slope = height * phi, stretch = height * phi * scaled;
    double margin_Phi = 0, margin_phi = 0;
    if constexpr (kThinMargin) {
      const double beyond = scaled - width * inverse;
      gauss.At(beyond, margin_Phi, margin_phi);
      grey -= edge * margin_Phi;
      slope -= edge * margin_phi;
      stretch -= edge * margin_phi * beyond;
    }
    // A saturated pixel only bounds the light.
    if ((sample.grey <= kMinGrey && grey <= kMinGrey) ||
        (sample.grey >= kMaxGrey && grey >= kMaxGrey)) {
      continue;
    }
    Derivatives<kThinMargin> row;
    row[0] = -slope * inverse * (1 - s);
    row[1] = -slope * inverse * s;
    row[2] = -stretch;
    row[3] = a, row[4] = b, row[5] = a * Phi, row[6] = b * Phi;
    if constexpr (kThinMargin) {
      row[7] = -margin_Phi;
      row[8] = edge * margin_phi * inverse;
    }
    work(sample, sample.grey - grey, knot, row);
  }
}

/// Normal equations of the pixels between two knots.
template <bool kThinMargin>
struct Block {
  static constexpr int kCount = kThinMargin ? 9 : 7;
  std::array<std::array<double, kCount>, kCount> products{};
  std::array<double, kCount> right{};

  void Add(const Derivatives<kThinMargin>& row, double weight, double residual) {
    for (int i = 0; i < kCount; ++i) {
      const double weighted = weight * row[i];
      for (int j = 0; j <= i; ++j) products[i][j] += weighted * row[j];
      right[i] += weighted * residual;
    }
  }
  void AddTo(const Model& model, int knot, Model::Matrix& JtJ, Model::Vector& Jtr) const {
    const int dark = Model::kShared + knot, step = dark + model.knots;
    const int index[9] = {0, 1, 2, dark, dark + 1, step, step + 1, 3, 4};
    for (int i = 0; i < kCount; ++i) {
      for (int j = 0; j <= i; ++j) {
        JtJ(std::max(index[i], index[j]), std::min(index[i], index[j])) += products[i][j];
      }
      Jtr[index[i]] += right[i];
    }
  }
};

template <bool kThinMargin>
Sum Accumulate(std::vector<Sample>& samples, const Model& model, Model::Matrix& JtJ,
               Model::Vector& Jtr) {
  JtJ.setZero(model.x.size(), model.x.size());
  Jtr.setZero(model.x.size());
  Sum sum;
  Block<kThinMargin> block;  // samples of the same block follow each other
  int at = 0;
  ForResiduals<kThinMargin>(samples, model,
                            [&](const Sample& sample, double residual, int knot, const auto& row) {
                              if (knot != at) {
                                block.AddTo(model, at, JtJ, Jtr);
                                block = {};
                                at = knot;
                              }
                              block.Add(row, sample.weight, residual);
                              const double square = sample.weight * residual * residual;
                              sum.squares += square;
                              sum.fourth_powers += square * residual * residual;
                              sum.weights += sample.weight;
                              ++sum.count;
                            });
  block.AddTo(model, at, JtJ, Jtr);
  return sum;
}

/// Ties log sigma to its typical value if there are few pixels, and the levels of neighbouring
/// knots to each other, weighted by the noise of the grey levels.
void AddPrior(const Sum& sum, bool few, const Model& model, Model::Matrix& JtJ,
              Model::Vector& Jtr) {
  const double variance = std::max(1.0, sum.squares / std::max(1.0, sum.weights));
  const double step = std::max(1.0, std::abs(model.MeanStep()));
  if (few) {
    const double weight = variance / (kLogBlurSd * kLogBlurSd);
    JtJ(2, 2) += weight;
    Jtr[2] += weight * (std::log(kTypicalBlur_px) - model.x[2]);
  }
  const double level_sd = step * (few ? kLevelSd : kKnotSd),
               weight = variance / (level_sd * level_sd);
  for (const int first : {Model::kShared, Model::kShared + model.knots}) {
    for (int i = first; i + 1 < first + model.knots; ++i) {
      const double change = model.x[i + 1] - model.x[i];
      JtJ(i, i) += weight, JtJ(i + 1, i + 1) += weight, JtJ(i + 1, i) -= weight;
      Jtr[i] += weight * change, Jtr[i + 1] -= weight * change;
    }
  }
  if (!model.thin_margin) JtJ(3, 3) = JtJ(4, 4) = 1;
}

/// Reduces the weights of pixels with large residuals.
template <bool kThinMargin>
void Reweight(std::vector<Sample>& samples, const Model& model) {
  static thread_local std::vector<double> off;
  off.clear();
  ForResiduals<kThinMargin>(samples, model, [&](const Sample&, double residual, int, const auto&) {
    off.push_back(std::abs(residual));
  });
  if (off.empty()) return;
  const auto middle = off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2);
  std::nth_element(off.begin(), middle, off.end());
  const double limit = kOutlier * std::max(1.0, 1.483 * *middle);
  ForResiduals<kThinMargin>(samples, model, [&](Sample& sample, double residual, int, const auto&) {
    const double r = residual / limit;
    sample.weight = 1 / (1 + r * r);
  });
}

/// Fits one selection of pixels. @param model  initial values on input, the solution on output
template <bool kThinMargin>
std::optional<EdgeFit> FitSamples(std::vector<Sample>& samples, Model& model) {
  if (samples.size() < kMinSamples) return std::nullopt;
  const bool few = samples.size() < kFewSamples;
  auto& x = model.x;
  Model::Matrix JtJ;
  Model::Vector Jtr;
  Sum sum;
  bool converged = false;
  for (int round = 0, step = 0; step < kMaxSteps; ++step) {
    sum = Accumulate<kThinMargin>(samples, model, JtJ, Jtr);
    AddPrior(sum, few, model, JtJ, Jtr);
    // Weak prior, in case the pixels do not determine a parameter.
    const double held = 1e-6 * JtJ.diagonal().maxCoeff();
    JtJ.diagonal().array() += held;
    const Model::Vector change = JtJ.selfadjointView<Eigen::Lower>().ldlt().solve(Jtr);
    if (!change.allFinite()) return std::nullopt;
    x += change;
    x[2] = std::clamp(x[2], std::log(0.25), std::log(4.0));
    if (kThinMargin) x[4] = std::clamp(x[4], kMinMargin_px, 10.0);
    if (!(std::abs(x[0]) < kMaxShift_px && std::abs(x[1]) < kMaxShift_px)) return std::nullopt;
    converged = std::abs(change[0]) < kConverged_px && std::abs(change[1]) < kConverged_px;
    if (!converged && step + 1 < kMaxSteps) continue;
    if (round == kReweightRounds || (round == 0 && sum.Kurtosis() < kMaxKurtosis)) break;
    Reweight<kThinMargin>(samples, model);
    ++round;
    step = 0;
  }
  if (!(model.MeanStep() > 0) || sum.count < static_cast<int>(kMinSamples)) return std::nullopt;
  const int parameters = static_cast<int>(x.size()) - (kThinMargin ? 0 : 2);
  const double variance = sum.Variance(parameters);
  Eigen::Matrix<double, Eigen::Dynamic, 2, 0, Model::kMost, 2> first_two =
      Eigen::Matrix<double, Eigen::Dynamic, 2, 0, Model::kMost, 2>::Zero(x.size(), 2);
  first_two(0, 0) = first_two(1, 1) = 1;
  const Eigen::Matrix<double, Eigen::Dynamic, 2, 0, Model::kMost, 2> columns =
      variance * JtJ.selfadjointView<Eigen::Lower>().ldlt().solve(first_two);
  return EdgeFit{x[0], x[1], columns.topRows<2>(), std::exp(x[2])};
}

}  // namespace

std::optional<EdgeFit> FitEdge(const image::LumaView& image, const EdgeRegion& region) {
  const double length = (region.end - region.start).norm();
  static thread_local std::vector<Sample> samples;
  Model model(length);
  double blur = kTypicalBlur_px;
  for (;;) {
    const double reach =
        std::max(kMinReach_px, std::min(kReach * blur, region.cell_px - kOtherEdgesMargin * blur));
    CollectSamples(image, region, reach, std::min(kCornerMargin * blur, 0.2 * length), samples);
    InitializeLevels(samples, reach, model);
    auto fit =
        model.thin_margin ? FitSamples<true>(samples, model) : FitSamples<false>(samples, model);
    if (fit && model.thin_margin) {
      fit->covariance.array() += kThinMarginSd_px * kThinMarginSd_px;
    }
    if (!fit || blur > kTypicalBlur_px || fit->blur_px < kReselectRatio * blur) return fit;
    blur = fit->blur_px;
  }
}

}  // namespace plumbline::vision
