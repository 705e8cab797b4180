#include "firmware-like/lens/lens_curve.h"

#include <algorithm>
#include <cmath>

namespace plumbline::lens {
namespace {

/// The interpolated values: logarithms of the focal lengths, the other parameters unchanged.
LensVector ValuesOf(const Lens& lens) {
  LensVector values = VectorOfLens(lens);
  values[0] = std::log(values[0]);
  values[1] = std::log(values[1]);
  return values;
}

bool Usable(const LensNode& node) {
  return VectorOfLens(node.lens).allFinite() && node.covariance.allFinite() && node.lens.fx > 0 &&
         node.lens.fy > 0;
}

double EndSlope(double h0, double h1, double m0, double m1) {
  const double slope = ((2 * h0 + h1) * m0 - h0 * m1) / (h0 + h1);
  if (slope * m0 <= 0) return 0;
  if (m0 * m1 <= 0 && std::abs(slope) > 3 * std::abs(m0)) return 3 * m0;
  return slope;
}

std::vector<double> Without(const std::vector<double>& values, std::size_t i) {
  std::vector<double> others = values;
  others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
  return others;
}

}  // namespace

std::vector<double> MonotoneSlopes(const std::vector<double>& x, const std::vector<double>& y) {
  const std::size_t count = x.size();
  std::vector<double> d(count, 0.0);
  if (count < 2) return d;
  std::vector<double> h(count - 1), m(count - 1);
  for (std::size_t i = 0; i + 1 < count; ++i) {
    h[i] = x[i + 1] - x[i];
    m[i] = (y[i + 1] - y[i]) / h[i];
  }
  if (count == 2) return {m[0], m[0]};
  for (std::size_t i = 1; i + 1 < count; ++i) {
    if (m[i - 1] * m[i] <= 0) continue;
    const double w1 = 2 * h[i] + h[i - 1], w2 = h[i] + 2 * h[i - 1];
    d[i] = (w1 + w2) / (w1 / m[i - 1] + w2 / m[i]);
  }
  d.front() = EndSlope(h[0], h[1], m[0], m[1]);
  d.back() = EndSlope(h[count - 2], h[count - 3], m[count - 2], m[count - 3]);
  return d;
}

CubicValue CubicAt(double x0, double x1, double y0, double y1, double d0, double d1, double at) {
  const double h = x1 - x0, t = (at - x0) / h;
  const double m = (y1 - y0) / h;
  const double c = 3 * m - 2 * d0 - d1, e = d0 + d1 - 2 * m;  // y = y0 + h (d0 t + c t^2 + e t^3)
  return {y0 + h * t * (d0 + t * (c + t * e)), d0 + t * (2 * c + 3 * t * e)};
}

LensCurve::LensCurve(std::vector<LensNode> nodes) {
  std::stable_sort(nodes.begin(), nodes.end(), [](const LensNode& a, const LensNode& b) {
    return a.zoom_counts < b.zoom_counts;
  });
  for (const LensNode& node : nodes) {
    if (!Usable(node)) continue;
    if (!nodes_.empty() && nodes_.back().zoom_counts == node.zoom_counts) nodes_.pop_back();
    nodes_.push_back(node);
  }
  y_.resize(kLensParameters);
  for (const LensNode& node : nodes_) {
    x_.push_back(node.zoom_counts);
    const LensVector values = ValuesOf(node.lens);
    for (std::size_t k = 0; k < kLensParameters; ++k) {
      y_[k].push_back(values[static_cast<Eigen::Index>(k)]);
    }
  }
  for (const auto& y : y_) d_.push_back(MonotoneSlopes(x_, y));
  FindInterpolationError();
}

void LensCurve::FindInterpolationError() {
  if (x_.size() < 2) return;
  const std::size_t intervals = x_.size() - 1;
  error_.assign(intervals, LensVector::Zero());
  // Width of an interval: change of ln f in it, plus a tenth of its range distributed over the
  // counts.
  const auto [low_f, high_f] = std::minmax_element(y_[0].begin(), y_[0].end());
  const double even = 0.1 * (*high_f - *low_f) / (x_.back() - x_.front());
  std::vector<double> width(intervals);
  for (std::size_t i = 0; i < intervals; ++i) {
    width[i] = std::abs(y_[0][i + 1] - y_[0][i]) + even * (x_[i + 1] - x_[i]);
  }
  // Leave-one-out error of each inner node, divided by the square of the gap.
  std::vector<LensVector> rate(x_.size(), LensVector::Zero());
  LensVector largest = LensVector::Zero();
  for (std::size_t i = 1; i + 1 < x_.size(); ++i) {
    const std::vector<double> x = Without(x_, i);
    const double gap = width[i - 1] + width[i];
    const double t = (x_[i] - x_[i - 1]) / (x_[i + 1] - x_[i - 1]);
    for (std::size_t k = 0; k < kLensParameters; ++k) {
      const std::vector<double> y = Without(y_[k], i);
      const std::vector<double> d = MonotoneSlopes(x, y);
      const double predicted = CubicAt(x[i - 1], x[i], y[i - 1], y[i], d[i - 1], d[i], x_[i]).value;
      rate[i][static_cast<Eigen::Index>(k)] =
          std::abs(predicted - y_[k][i]) / (gap * gap * 4 * t * (1 - t));
    }
    largest = largest.cwiseMax(rate[i]);
  }
  for (std::size_t i = 0; i < intervals; ++i) {
    const bool end = x_.size() >= 4 && (i == 0 || i + 1 == intervals);
    error_[i] = (end ? kEndFactor : 1) * width[i] * width[i] *
                rate[i].cwiseMax(rate[i + 1]).cwiseMax(0.5 * largest);
    if (x_.size() >= 4) continue;
    const double share = x_.size() == 2 ? kUnseenOfTwo : kUnseenOfThree;
    for (std::size_t k = 0; k < kLensParameters; ++k) {
      const auto [low, high] = std::minmax_element(y_[k].begin(), y_[k].end());
      double& error = error_[i][static_cast<Eigen::Index>(k)];
      error = std::max(error, (k < 2 ? share : 1) * (*high - *low));
    }
  }
}

std::size_t LensCurve::IntervalOf(double zoom_counts) const {
  const auto after = std::upper_bound(x_.begin() + 1, x_.end() - 1, zoom_counts);
  return static_cast<std::size_t>(after - x_.begin()) - 1;
}

LensVector LensCurve::Interpolated(double zoom_counts) const {
  const std::size_t i = IntervalOf(zoom_counts);
  LensVector values;
  for (std::size_t k = 0; k < kLensParameters; ++k) {
    values[static_cast<Eigen::Index>(k)] =
        CubicAt(x_[i], x_[i + 1], y_[k][i], y_[k][i + 1], d_[k][i], d_[k][i + 1], zoom_counts)
            .value;
  }
  return values;
}

std::optional<InterpolatedLens> LensCurve::At(double zoom_counts) const {
  if (x_.empty() || !(zoom_counts >= x_.front() && zoom_counts <= x_.back())) return std::nullopt;
  InterpolatedLens found;
  if (x_.size() == 1) {
    found.lens = nodes_[0].lens;
    found.covariance = nodes_[0].covariance;
    found.log_focal_sd = std::sqrt(std::max(0.0, found.covariance(0, 0))) / found.lens.fx;
    return found;
  }
  const std::size_t i = IntervalOf(zoom_counts);
  const double t = (zoom_counts - x_[i]) / (x_[i + 1] - x_[i]);
  LensVector values = Interpolated(zoom_counts);
  values[0] = std::exp(values[0]);
  values[1] = std::exp(values[1]);
  found.lens = LensOfVector(values, nodes_[0].lens.fisheye);
  found.log_focal_per_count =
      CubicAt(x_[i], x_[i + 1], y_[0][i], y_[0][i + 1], d_[0][i], d_[0][i + 1], zoom_counts).slope;

  // Covariances of the nodes, rescaled to the interpolated focal lengths.
  const auto scaled = [&values](const LensNode& node) {
    LensVector scale = LensVector::Ones();
    scale[0] = values[0] / node.lens.fx;
    scale[1] = values[1] / node.lens.fy;
    return LensCovariance(scale.asDiagonal() * node.covariance * scale.asDiagonal());
  };
  LensVector error = 4 * t * (1 - t) * error_[i];
  error[0] *= values[0];
  error[1] *= values[1];
  found.covariance = (1 - t) * scaled(nodes_[i]) + t * scaled(nodes_[i + 1]);
  found.covariance.diagonal() += error.cwiseAbs2();
  found.log_focal_sd = std::sqrt(std::max(0.0, found.covariance(0, 0))) / values[0];
  return found;
}

}  // namespace plumbline::lens
