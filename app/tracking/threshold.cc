#include "app/tracking/threshold.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace plumbline::tracking {
namespace {

constexpr int kTile = 4;                         // [px]
constexpr double kTileRangeOfNoise = 3;          // range of 16 normal numbers, flattest fifth [sd]
constexpr double kRangeInNoise = 6.5;            // the range of 144 of them is 5.3 on average
constexpr int kMinRange = 5, kMaxMinRange = 24;  // [grey levels]

void Halve(const image::LumaView& image, const ImageBox& box, SearchImage& search) {
  for (int y = 0; y < search.height; ++y) {
    const std::uint8_t* upper = image.row(box.v0 + 2 * y) + box.u0;
    const std::uint8_t* lower = image.row(box.v0 + 2 * y + 1) + box.u0;
    std::uint8_t* out = &search.grey[static_cast<std::size_t>(y) * search.width];
    for (std::ptrdiff_t x = 0; x < search.width; ++x) {
      const int sum = upper[2 * x] + upper[2 * x + 1] + lower[2 * x] + lower[2 * x + 1];
      out[x] = static_cast<std::uint8_t>((sum + 2) / 4);
    }
  }
}

void Smooth(const image::LumaView& image, const ImageBox& box, SearchImage& search) {
  std::vector<std::uint16_t> column(static_cast<std::size_t>(search.width) + 2);
  for (int y = 0; y < search.height; ++y) {
    const int v = box.v0 + y;
    const std::uint8_t* above = image.row(std::max(v - 1, 0));
    const std::uint8_t* here = image.row(v);
    const std::uint8_t* below = image.row(std::min(v + 1, image.height - 1));
    for (int x = -1; x <= search.width; ++x) {
      const int u = std::clamp(box.u0 + x, 0, image.width - 1);
      column[x + 1] = static_cast<std::uint16_t>(above[u] + 2 * here[u] + below[u]);
    }
    std::uint8_t* out = &search.grey[static_cast<std::size_t>(y) * search.width];
    for (int x = 0; x < search.width; ++x) {
      out[x] = static_cast<std::uint8_t>((column[x] + 2 * column[x + 1] + column[x + 2] + 8) / 16);
    }
  }
}

}  // namespace

ImageBox WithinImage(const ImageBox& box, image::ImageSize size) {
  ImageBox within{std::clamp(box.u0, 0, size.width), std::clamp(box.v0, 0, size.height), 0, 0};
  within.u1 = std::clamp(box.u1, within.u0, size.width);
  within.v1 = std::clamp(box.v1, within.v0, size.height);
  return within;
}

void MakeSearchImage(const image::LumaView& image, const ImageBox& box, int shrink,
                     SearchImage& search) {
  search.shrink = shrink;
  search.u0 = box.u0;
  search.v0 = box.v0;
  search.width = box.width() / shrink;
  search.height = box.height() / shrink;
  search.grey.resize(static_cast<std::size_t>(search.width) * search.height);
  if (shrink == 2) {
    Halve(image, box, search);
  } else {
    Smooth(image, box, search);
  }
}

void Threshold::MeasureTiles(const SearchImage& search) {
  columns_ = (search.width + kTile - 1) / kTile;
  rows_ = (search.height + kTile - 1) / kTile;
  const std::size_t tiles = static_cast<std::size_t>(columns_) * rows_;
  lowest_.assign(tiles, 255);
  highest_.assign(tiles, 0);
  for (int y = 0; y < search.height; ++y) {
    const std::uint8_t* row = &search.grey[static_cast<std::size_t>(y) * search.width];
    std::uint8_t* low = &lowest_[static_cast<std::size_t>(y / kTile) * columns_];
    std::uint8_t* high = &highest_[static_cast<std::size_t>(y / kTile) * columns_];
    for (int x = 0; x < search.width; ++x) {
      low[x / kTile] = std::min(low[x / kTile], row[x]);
      high[x / kTile] = std::max(high[x / kTile], row[x]);
    }
  }
}

int Threshold::MinRange() const {
  std::array<int, 256> count{};
  for (std::size_t i = 0; i < lowest_.size(); ++i) ++count[highest_[i] - lowest_[i]];
  int below = 0, range = 0;
  while (range < 255 && below + count[range] < static_cast<int>(lowest_.size() / 5)) {
    below += count[range++];
  }
  const int least = static_cast<int>(std::lround(kRangeInNoise * range / kTileRangeOfNoise));
  return std::clamp(least, kMinRange, kMaxMinRange);
}

void Threshold::Apply(SearchImage& search, bool whole_image) {
  search.dark.resize(search.grey.size());
  if (fixed_) {
    min_range_ = kMinRange;
    const int level = *fixed_;
    for (std::size_t i = 0; i < search.grey.size(); ++i) search.dark[i] = search.grey[i] < level;
    return;
  }
  MeasureTiles(search);
  min_range_ = whole_image ? MinRange() : std::min(min_range_, MinRange());
  level_.resize(static_cast<std::size_t>(columns_) + 1);
  for (int tile_row = 0; tile_row < rows_; ++tile_row) {
    for (int column = 0; column < columns_; ++column) {
      int low = 255, high = 0;
      for (int r = std::max(tile_row - 1, 0); r <= std::min(tile_row + 1, rows_ - 1); ++r) {
        for (int c = std::max(column - 1, 0); c <= std::min(column + 1, columns_ - 1); ++c) {
          low = std::min<int>(low, lowest_[static_cast<std::size_t>(r) * columns_ + c]);
          high = std::max<int>(high, highest_[static_cast<std::size_t>(r) * columns_ + c]);
        }
      }
      // Level 0 marks no pixel as dark: the grey levels hardly vary here.
      level_[column] = high - low < min_range_ ? std::uint8_t{0}
                                               : static_cast<std::uint8_t>((low + high + 1) / 2);
    }
    for (int y = tile_row * kTile; y < std::min((tile_row + 1) * kTile, search.height); ++y) {
      const std::size_t start = static_cast<std::size_t>(y) * search.width;
      for (int x = 0; x < search.width; ++x) {
        search.dark[start + x] = search.grey[start + x] < level_[x / kTile];
      }
    }
  }
}

}  // namespace plumbline::tracking
