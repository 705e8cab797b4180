#include "app/vision/lens/board_shading.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "firmware-like/statistics/statistics.h"

namespace plumbline::vision {
namespace {

constexpr int kMinSamples = 45;               // of each colour: three per coefficient
constexpr double kMinDistance_px = 3;         // of a sample from the edges
constexpr double kMinGradient_per_px = 2e-4;  // displaces a corner by about 0.001 px
constexpr double kOutlyingSample = 4;         // in units of the median deviation
constexpr double kMinContrastShare = 0.02;    // of that in the middle
constexpr int kNodeSpacing_px = 16;

double MeanAround(const cv::Mat& image, int u, int v) {
  double sum = 0;
  for (int j = -1; j <= 1; ++j) {
    for (int i = -1; i <= 1; ++i) sum += image.at<std::uint8_t>(v + j, u + i);
  }
  return sum / 9;
}

}  // namespace

BoardShading::Polynomial BoardShading::TermsAt(const lens::Vec2& pixel) const {
  const lens::Vec2 at = (pixel - middle_).cwiseQuotient(half_);
  Polynomial terms;
  int k = 0;
  for (int degree = 0; degree <= 4; ++degree) {
    for (int i = 0; i <= degree; ++i)
      terms[k++] = std::pow(at.x(), degree - i) * std::pow(at.y(), i);
  }
  return terms;
}

lens::Vec2 BoardShading::WhiteAndBlackAt(const lens::Vec2& pixel) const {
  const Polynomial terms = TermsAt(pixel);
  return {white_.dot(terms), black_.dot(terms)};
}

bool BoardShading::FitPolynomial(const std::vector<lens::Vec2>& at, const std::vector<double>& grey,
                                 Polynomial& polynomial) const {
  if (at.size() < kMinSamples) return false;
  std::vector<double> weights(at.size(), 1);
  for (int pass = 0; pass < 2; ++pass) {
    Eigen::Matrix<double, kTerms, kTerms> square =
        1e-6 * Eigen::Matrix<double, kTerms, kTerms>::Identity();
    Polynomial mixed = Polynomial::Zero();
    for (std::size_t k = 0; k < at.size(); ++k) {
      const Polynomial terms = TermsAt(at[k]);
      square += weights[k] * terms * terms.transpose();
      mixed += weights[k] * grey[k] * terms;
    }
    polynomial = square.ldlt().solve(mixed);
    std::vector<double> deviations;
    for (std::size_t k = 0; k < at.size(); ++k)
      deviations.push_back(std::abs(grey[k] - polynomial.dot(TermsAt(at[k]))));
    std::vector<double> sorted = deviations;
    const double limit = kOutlyingSample * std::max(0.5, statistics::MedianOf(sorted));
    for (std::size_t k = 0; k < at.size(); ++k) weights[k] = deviations[k] < limit ? 1 : 0;
  }
  return polynomial.allFinite();
}

BoardShading::BoardShading(const cv::Mat& image, const std::vector<LatticeSteps>& steps,
                           const BoardView& view, double rim) {
  const double share = rim < 0.5 ? 0.55 * rim : 0.5;  // of a step, from both edges
  std::vector<lens::Vec2> at[2];                      // white, black
  std::vector<double> grey[2];
  lens::Vec2 least = lens::Vec2::Constant(1e9), most = lens::Vec2::Constant(-1e9);
  for (std::size_t k = 0; k < view.corners_px.size(); ++k) {
    if (!view.seen[k]) continue;
    const lens::Vec2 row = share * steps[k].along_row, column = share * steps[k].down_column;
    if (std::min(row.norm(), column.norm()) < kMinDistance_px) return;
    const lens::Vec2 offsets[4] = {row + column, -row - column, row - column, column - row};
    double values[4];
    bool inside = true;
    for (int i = 0; i < 4 && inside; ++i) {
      const lens::Vec2 q = view.corners_px[k] + offsets[i];
      const int u = static_cast<int>(std::lround(q.x())), v = static_cast<int>(std::lround(q.y()));
      inside = u > 0 && v > 0 && u + 1 < image.cols && v + 1 < image.rows;
      if (inside) values[i] = MeanAround(image, u, v);
    }
    if (!inside) continue;
    const bool first_is_white = values[0] + values[1] > values[2] + values[3];
    for (int i = 0; i < 4; ++i) {
      const int colour = (i < 2) == first_is_white ? 0 : 1;
      const lens::Vec2 q = view.corners_px[k] + offsets[i];
      at[colour].push_back(q);
      grey[colour].push_back(values[i]);
      least = least.cwiseMin(q);
      most = most.cwiseMax(q);
    }
  }
  if (at[0].size() < kMinSamples) return;
  middle_ = 0.5 * (least + most);
  half_ = (0.5 * (most - least)).cwiseMax(1);
  if (!FitPolynomial(at[0], grey[0], white_) || !FitPolynomial(at[1], grey[1], black_)) return;
  const lens::Vec2 in_the_middle = WhiteAndBlackAt(middle_);
  contrast_ = in_the_middle.x() - in_the_middle.y();
  significant_ = contrast_ > 1 && HasGradient();
}

bool BoardShading::HasGradient() const {
  constexpr int kSteps = 8;
  for (int j = 0; j <= kSteps; ++j) {
    for (int i = 0; i <= kSteps; ++i) {
      const lens::Vec2 at =
          middle_ + half_.cwiseProduct(lens::Vec2(2.0 * i / kSteps - 1, 2.0 * j / kSteps - 1));
      const lens::Vec2 here = WhiteAndBlackAt(at);
      const lens::Vec2 right = WhiteAndBlackAt(at + lens::Vec2(1, 0)),
                       below = WhiteAndBlackAt(at + lens::Vec2(0, 1));
      const double contrast = here.x() - here.y();
      if (contrast > kMinContrastShare * contrast_ &&
          std::hypot(right.x() - here.x(), below.x() - here.x()) > kMinGradient_per_px * contrast)
        return true;
    }
  }
  return false;
}

void BoardShading::Flatten(cv::Mat& part, const lens::Vec2& origin) const {
  // Gain and offset at nodes, interpolated linearly in between.
  const int columns = part.cols / kNodeSpacing_px + 2, rows = part.rows / kNodeSpacing_px + 2;
  cv::Mat gain(rows, columns, CV_32F), offset(rows, columns, CV_32F);
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const lens::Vec2 at = origin + kNodeSpacing_px * lens::Vec2(i, j);
      const lens::Vec2 limited = (at - middle_).cwiseMin(half_).cwiseMax(-half_) + middle_;
      const lens::Vec2 both = WhiteAndBlackAt(limited);
      const double contrast = std::max(both.x() - both.y(), kMinContrastShare * contrast_);
      gain.at<float>(j, i) = static_cast<float>(contrast_ / contrast);
      offset.at<float>(j, i) = static_cast<float>(-both.y() * contrast_ / contrast);
    }
  }
  constexpr float kShare = 1.0F / kNodeSpacing_px;
  for (int v = 0; v < part.rows; ++v) {
    const int j = v / kNodeSpacing_px;
    const float b = static_cast<float>(v % kNodeSpacing_px) * kShare;
    const float* gains[2] = {gain.ptr<float>(j), gain.ptr<float>(j + 1)};
    const float* offsets[2] = {offset.ptr<float>(j), offset.ptr<float>(j + 1)};
    float* row = part.ptr<float>(v);
    for (int i = 0; i * kNodeSpacing_px < part.cols; ++i) {
      const float g0 = gains[0][i] + b * (gains[1][i] - gains[0][i]);
      const float g1 = gains[0][i + 1] + b * (gains[1][i + 1] - gains[0][i + 1]);
      const float o0 = offsets[0][i] + b * (offsets[1][i] - offsets[0][i]);
      const float o1 = offsets[0][i + 1] + b * (offsets[1][i + 1] - offsets[0][i + 1]);
      const float dg = (g1 - g0) * kShare, d0 = (o1 - o0) * kShare;
      float* pixels = row + i * kNodeSpacing_px;
      const int count = std::min(kNodeSpacing_px, part.cols - i * kNodeSpacing_px);
      for (int u = 0; u < count; ++u) {
        const float a = static_cast<float>(u);
        pixels[u] = pixels[u] * (g0 + a * dg) + o0 + a * d0;
      }
    }
  }
}

}  // namespace plumbline::vision
