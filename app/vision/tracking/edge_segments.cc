#include "app/vision/tracking/edge_segments.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

namespace plumbline::vision {
namespace {

constexpr float kLinkedCos = 0.7F;     // between the directions of linked pixels
constexpr float kOnwardCos = 0.5F;     // between a pixel's direction and the way to the next one
constexpr double kStraightCos = 0.88;  // between a pixel's direction and that of its segment
constexpr double kMaxMiss_px = 1.0;    // from the segment's line
constexpr int kFirstFit = 4;           // pixels; a line through fewer is less exact than gradients

std::int16_t Magnitude(std::int16_t x) {
  return std::max(x, static_cast<std::int16_t>(-x));
}

/// Central differences, and the sum of their magnitudes.
void SetGradients(const std::uint8_t* __restrict here, std::ptrdiff_t width, int x0, int x1,
                  std::int16_t* __restrict gu, std::int16_t* __restrict gv,
                  std::int16_t* __restrict step) {
  const std::uint8_t *const above = here - width, *const below = here + width;
  for (std::ptrdiff_t x = x0; x < x1; ++x) {
    gu[x] = static_cast<std::int16_t>(here[x + 1] - here[x - 1]);
    gv[x] = static_cast<std::int16_t>(below[x] - above[x]);
    step[x] = static_cast<std::int16_t>(Magnitude(gu[x]) + Magnitude(gv[x]));
  }
}

/// Marks with 1 the maxima of `step` across the edge that reach `least`.
void MarkMaxima(const std::int16_t* __restrict gu, const std::int16_t* __restrict gv,
                const std::int16_t* step, std::ptrdiff_t width, int x0, int x1, std::int16_t least,
                std::int16_t* __restrict edge) {
  const std::int16_t *const above = step - width, *const below = step + width;
  for (std::ptrdiff_t x = x0; x < x1; ++x) {
    // All ones if the edge runs from top to bottom; without branches, for vectorization.
    const auto upright = static_cast<std::int16_t>(-(Magnitude(gu[x]) >= Magnitude(gv[x])));
    const auto previous =
        static_cast<std::int16_t>((step[x - 1] & upright) | (above[x] & ~upright));
    const auto next = static_cast<std::int16_t>((step[x + 1] & upright) | (below[x] & ~upright));
    edge[x] =
        static_cast<std::int16_t>((step[x] >= least) & (step[x] > previous) & (step[x] >= next));
  }
}

/// Straight line through pixels that are added one by one.
class GrowingLine {
 public:
  void Add(double u, double v, double along_u, double along_v) {
    n_ += 1;
    u_ += u, v_ += v, uu_ += u * u, uv_ += u * v, vv_ += v * v;
    along_ += lens::Vec2(along_u, along_v);
    if (n_ < kFirstFit) {
      direction_ = along_.normalized();
    } else if (n_ < 2 * kFirstFit || static_cast<int>(n_) % 4 == 0) {
      Fit();
    }
  }
  /// One step of the power iteration for the axis of largest spread.
  void Fit() {
    const double cuu = uu_ - u_ * u_ / n_, cuv = uv_ - u_ * v_ / n_, cvv = vv_ - v_ * v_ / n_;
    const lens::Vec2 turned(cuu * direction_.x() + cuv * direction_.y(),
                            cuv * direction_.x() + cvv * direction_.y());
    const double norm = turned.norm();
    if (norm > 1e-9) direction_ = turned / norm;
  }
  const lens::Vec2& direction() const { return direction_; }
  lens::Vec2 middle() const { return {u_ / n_, v_ / n_}; }
  double MissOf(double u, double v) const {
    return std::abs(direction_.x() * (v - v_ / n_) - direction_.y() * (u - u_ / n_));
  }
  int count() const { return static_cast<int>(n_); }

 private:
  double n_ = 0, u_ = 0, v_ = 0, uu_ = 0, uv_ = 0, vv_ = 0;
  lens::Vec2 along_ = lens::Vec2::Zero(), direction_ = lens::Vec2::UnitX();
};

}  // namespace

/// The edge pixels of one row between two columns.
void EdgeSegmentFinder::AddRow(const SearchImage& search, int y, int x0, int x1, int buffer_row,
                               int min_step) {
  const auto width = static_cast<std::size_t>(search.width);
  const std::size_t row = static_cast<std::size_t>(buffer_row) * width;
  const std::int16_t *const step = &step_[row], *const above = step - width,
                            *const below = step + width;
  const std::int16_t *const gu = &gu_[row], *const gv = &gv_[row];
  std::int16_t* const edge = is_edge_.data();
  MarkMaxima(gu, gv, step, search.width, x0, x1, static_cast<std::int16_t>(min_step), edge);
  const std::int16_t* const end = edge + x1;
  for (const std::int16_t* at = edge + x0; at != end; ++at) {
    // Few pixels are edges: skip four at a time.
    std::uint64_t four = 0;
    while (end - at >= 4 && (std::memcpy(&four, at, sizeof four), four == 0)) at += 4;
    if (at == end) break;
    if (*at == 0) continue;
    const auto x = static_cast<int>(at - edge);
    const bool across = Magnitude(gu[x]) >= Magnitude(gv[x]);
    const int before = across ? step[x - 1] : above[x], after = across ? step[x + 1] : below[x];
    const int bend = before - 2 * step[x] + after;
    const float shift =
        bend < 0 ? 0.5F * static_cast<float>(before - after) / static_cast<float>(bend) : 0.0F;
    const auto u = static_cast<float>(gu[x]), v = static_cast<float>(gv[x]);
    const float norm = 1 / std::sqrt(u * u + v * v);
    pixels_.push_back({x, y, static_cast<float>(x) + (across ? shift : 0),
                       static_cast<float>(y) + (across ? 0 : shift), -v * norm, u * norm, -1, false,
                       false});
  }
}

void EdgeSegmentFinder::FindPixels(const SearchImage& search, int min_step) {
  const int width = search.width, height = search.height;
  const int tiles = search.tile_columns();
  pixels_.clear();
  row_start_.assign(static_cast<std::size_t>(height) + 1, 0);
  const std::size_t buffer = static_cast<std::size_t>(SearchImage::kTile + 2) * width;
  step_.resize(buffer);
  gu_.resize(buffer);
  gv_.resize(buffer);
  is_edge_.resize(width);
  for (int y0 = 0; y0 < height; y0 += SearchImage::kTile) {
    const std::uint8_t* const contrast =
        &search.contrast[static_cast<std::size_t>(y0 / SearchImage::kTile) * tiles];
    const int y1 = std::min(y0 + SearchImage::kTile, height);
    runs_.clear();
    for (int c = 0; c < tiles;) {
      int end = c;
      while (end < tiles && contrast[end] != 0) ++end;
      const int x0 = std::max(c * SearchImage::kTile, 2);
      const int x1 = std::min(end * SearchImage::kTile, width - 2);
      if (x0 < x1 && end > c) runs_.emplace_back(x0, x1);
      c = end + 1;
    }
    // Gradients of each run of tiles with contrast, with one pixel around it.
    for (int y = y0 - 1; y <= y1 && !runs_.empty(); ++y) {
      const std::size_t to = static_cast<std::size_t>(y - y0 + 1) * width;
      for (const auto& [x0, x1] : runs_) {
        if (y < 1 || y >= height - 1) {
          std::fill(&step_[to + x0 - 1], &step_[to + x1 + 1], std::int16_t{0});
        } else {
          SetGradients(&search.grey[static_cast<std::size_t>(y) * width], width, x0 - 1, x1 + 1,
                       &gu_[to], &gv_[to], &step_[to]);
        }
      }
    }
    for (int y = y0; y < y1; ++y) {
      row_start_[y] = static_cast<int>(pixels_.size());
      if (y < 1 || y >= height - 1) continue;
      for (const auto& [x0, x1] : runs_) AddRow(search, y, x0, x1, y - y0 + 1, min_step);
    }
  }
  row_start_[height] = static_cast<int>(pixels_.size());
}

/// Chooses for each pixel the neighbour that continues its edge.
void EdgeSegmentFinder::Link() {
  const int height = static_cast<int>(row_start_.size()) - 1;
  for (int y = 1; y + 1 < height; ++y) {
    int from[3] = {row_start_[y - 1], row_start_[y], row_start_[y + 1]};
    for (int i = row_start_[y]; i < row_start_[y + 1]; ++i) {
      EdgePixel& pixel = pixels_[i];
      float best = 0;
      for (int r = 0; r < 3; ++r) {
        const int end = row_start_[y + r];
        const auto down = static_cast<float>(r - 1);
        while (from[r] < end && pixels_[from[r]].x < pixel.x - 1) ++from[r];
        for (int j = from[r]; j < end && pixels_[j].x <= pixel.x + 1; ++j) {
          const EdgePixel& other = pixels_[j];
          const int du = other.x - pixel.x;
          const float cosine = (static_cast<float>(du) * pixel.along_u + down * pixel.along_v) *
                               (du != 0 && r != 1 ? std::numbers::sqrt2_v<float> / 2 : 1.0F);
          if (cosine < kOnwardCos) continue;  // or the pixel itself
          const float alike = pixel.along_u * other.along_u + pixel.along_v * other.along_v;
          if (alike < kLinkedCos || cosine + alike <= best) continue;
          best = cosine + alike;
          pixel.next = j;
        }
      }
      if (pixel.next >= 0) pixels_[pixel.next].has_previous = true;
    }
  }
}

/// Splits the chain that starts at a pixel into straight segments.
void EdgeSegmentFinder::Split(int first, double min_length, std::vector<EdgeSegment>& segments) {
  for (int i = first; i >= 0 && !pixels_[i].used;) {
    GrowingLine line;
    const int begin = i;
    int end = i, strays = 0;
    for (; i >= 0 && !pixels_[i].used && strays < 2; i = pixels_[i].next) {
      EdgePixel& pixel = pixels_[i];
      if (line.count() >= kFirstFit) {
        if (line.MissOf(pixel.u, pixel.v) > kMaxMiss_px) break;
        const lens::Vec2& direction = line.direction();
        if (direction.x() * pixel.along_u + direction.y() * pixel.along_v < kStraightCos) {
          ++strays;
        } else {
          strays = 0;
        }
      }
      pixel.used = true;
      if (strays > 0) continue;
      line.Add(pixel.u, pixel.v, pixel.along_u, pixel.along_v);
      end = i;
    }
    if (line.count() < kFirstFit) continue;
    line.Fit();
    line.Fit();
    const lens::Vec2 direction = line.direction(), middle = line.middle();
    const auto on_line = [&](const EdgePixel& pixel) -> lens::Vec2 {
      return middle + direction.dot(lens::Vec2(pixel.u, pixel.v) - middle) * direction;
    };
    const lens::Vec2 start = on_line(pixels_[begin]), stop = on_line(pixels_[end]);
    const double length = direction.dot(stop - start);
    if (length >= min_length) segments.push_back({start, stop, direction, length});
  }
}

void EdgeSegmentFinder::Find(const SearchImage& search, const Limits& limits,
                             std::vector<EdgeSegment>& segments) {
  FindPixels(search, limits.min_step);
  Link();
  for (int i = 0; i < static_cast<int>(pixels_.size()); ++i) {
    if (!pixels_[i].has_previous) Split(i, limits.min_length, segments);
  }
  for (int i = 0; i < static_cast<int>(pixels_.size()); ++i) {  // closed chains
    if (!pixels_[i].used) Split(i, limits.min_length, segments);
  }
}

}  // namespace plumbline::vision
