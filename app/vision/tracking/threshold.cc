#include "app/vision/tracking/threshold.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace plumbline::vision {
namespace {

constexpr int kTile = SearchImage::kTile;
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
  const auto width = static_cast<std::size_t>(search.width);
  std::vector<std::uint16_t> column(width + 2);  // from one pixel left of the box
  for (int y = 0; y < search.height; ++y) {
    const int v = box.v0 + y;
    const std::uint8_t* above = image.row(std::max(v - 1, 0)) + box.u0;
    const std::uint8_t* here = image.row(v) + box.u0;
    const std::uint8_t* below = image.row(std::min(v + 1, image.height - 1)) + box.u0;
    const auto sum_at = [&](std::ptrdiff_t x) {
      return static_cast<std::uint16_t>(above[x] + 2 * here[x] + below[x]);
    };
    for (std::size_t x = 0; x < width; ++x) column[x + 1] = sum_at(static_cast<std::ptrdiff_t>(x));
    column[0] = box.u0 > 0 ? sum_at(-1) : column[1];
    column[width + 1] = box.u0 + search.width < image.width ? sum_at(search.width) : column[width];
    std::uint8_t* out = &search.grey[static_cast<std::size_t>(y) * width];
    for (std::size_t x = 0; x < width; ++x) {
      out[x] = static_cast<std::uint8_t>((column[x] + 2 * column[x + 1] + column[x + 2] + 8) / 16);
    }
  }
}

void Copy(const image::LumaView& image, const ImageBox& box, SearchImage& search) {
  for (int y = 0; y < search.height; ++y) {
    const std::uint8_t* from = image.row(box.v0 + y) + box.u0;
    std::copy_n(from, search.width, &search.grey[static_cast<std::size_t>(y) * search.width]);
  }
}

}  // namespace

ImageBox WithinImage(const ImageBox& box, image::ImageSize size) {
  ImageBox within{std::clamp(box.u0, 0, size.width), std::clamp(box.v0, 0, size.height), 0, 0};
  within.u1 = std::clamp(box.u1, within.u0, size.width);
  within.v1 = std::clamp(box.v1, within.v0, size.height);
  return within;
}

void MakeSearchImage(const image::LumaView& image, const ImageBox& box, Reduction reduction,
                     SearchImage& search) {
  const int shrink = reduction == Reduction::kHalf ? 2 : 1;
  search.shrink = shrink;
  search.u0 = box.u0;
  search.v0 = box.v0;
  search.width = box.width() / shrink;
  search.height = box.height() / shrink;
  search.grey.resize(static_cast<std::size_t>(search.width) * search.height);
  switch (reduction) {
    case Reduction::kHalf:
      return Halve(image, box, search);
    case Reduction::kSmooth:
      return Smooth(image, box, search);
    case Reduction::kNone:
      return Copy(image, box, search);
  }
}

void MakeCoarser(const SearchImage& search, SearchImage& coarser) {
  const image::LumaView view{search.grey.data(), search.width, search.height, search.width};
  MakeSearchImage(view, {0, 0, search.width, search.height}, Reduction::kHalf, coarser);
  coarser.shrink = 2 * search.shrink;
  coarser.u0 = search.u0;
  coarser.v0 = search.v0;
}

lens::Lens SearchImage::LensOf(const lens::Lens& lens) const {
  lens::Lens reduced = lens;
  const lens::Vec2 centre = PixelOf({lens.cx, lens.cy});
  reduced.fx /= shrink, reduced.fy /= shrink;
  reduced.cx = centre.x(), reduced.cy = centre.y();
  return reduced;
}

void Threshold::MeasureTiles(const SearchImage& search) {
  columns_ = (search.width + kTile - 1) / kTile;
  rows_ = (search.height + kTile - 1) / kTile;
  const std::size_t tiles = static_cast<std::size_t>(columns_) * rows_;
  lowest_.resize(tiles);
  highest_.resize(tiles);
  const auto width = static_cast<std::size_t>(search.width);
  // Padded to whole tiles; the padding does not change the extremes.
  low_row_.assign(static_cast<std::size_t>(columns_) * kTile, 255);
  high_row_.assign(static_cast<std::size_t>(columns_) * kTile, 0);
  std::uint8_t* const low = low_row_.data();
  std::uint8_t* const high = high_row_.data();
  for (int tile_row = 0; tile_row < rows_; ++tile_row) {
    const int first = tile_row * kTile, end = std::min(first + kTile, search.height);
    const std::uint8_t* row = &search.grey[static_cast<std::size_t>(first) * width];
    std::copy_n(row, width, low);
    std::copy_n(row, width, high);
    for (int y = first + 1; y < end; ++y) {
      row += width;
      for (std::size_t x = 0; x < width; ++x) {
        low[x] = std::min(low[x], row[x]);
        high[x] = std::max(high[x], row[x]);
      }
    }
    const std::size_t start = static_cast<std::size_t>(tile_row) * columns_;
    for (std::size_t c = 0; c < static_cast<std::size_t>(columns_); ++c) {
      const std::uint8_t *l = low + kTile * c, *h = high + kTile * c;
      lowest_[start + c] = std::min(std::min(l[0], l[1]), std::min(l[2], l[3]));
      highest_[start + c] = std::max(std::max(h[0], h[1]), std::max(h[2], h[3]));
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
  const std::size_t tiles =
      static_cast<std::size_t>(search.tile_columns()) * ((search.height + kTile - 1) / kTile);
  search.contrast.assign(tiles, 1);
  if (fixed_) {
    min_range_ = kMinRange;
    const int level = *fixed_;
    for (std::size_t i = 0; i < search.grey.size(); ++i) search.dark[i] = search.grey[i] < level;
    return;
  }
  MeasureTiles(search);
  min_range_ = whole_image ? MinRange() : std::min(min_range_, MinRange());
  levels_.resize(static_cast<std::size_t>(columns_) * kTile);
  for (int tile_row = 0; tile_row < rows_; ++tile_row) {
    SetLevels(tile_row, &search.contrast[static_cast<std::size_t>(tile_row) * columns_]);
    const auto width = static_cast<std::size_t>(search.width);
    const std::uint8_t* const levels = levels_.data();
    for (int y = tile_row * kTile; y < std::min((tile_row + 1) * kTile, search.height); ++y) {
      const std::uint8_t* const grey = &search.grey[static_cast<std::size_t>(y) * width];
      std::uint8_t* const dark = &search.dark[static_cast<std::size_t>(y) * width];
      for (std::size_t x = 0; x < width; ++x) dark[x] = grey[x] < levels[x] ? 1 : 0;
    }
  }
}

/// The threshold of each column in a row of tiles: halfway between the extremes of three by three
/// tiles. Level 0 marks no pixel as dark: the grey levels hardly vary there.
void Threshold::SetLevels(int tile_row, std::uint8_t* contrast) {
  const auto columns = static_cast<std::size_t>(columns_);
  const std::size_t here = static_cast<std::size_t>(tile_row) * columns;
  const std::size_t above = tile_row > 0 ? here - columns : here;
  const std::size_t below = tile_row + 1 < rows_ ? here + columns : here;
  for (std::size_t c = 0; c < columns; ++c) {
    low_row_[c] = std::min({lowest_[above + c], lowest_[here + c], lowest_[below + c]});
    high_row_[c] = std::max({highest_[above + c], highest_[here + c], highest_[below + c]});
  }
  const int edge_range = this->edge_range();
  for (std::size_t c = 0; c < columns; ++c) {
    const std::size_t left = c > 0 ? c - 1 : c, right = std::min(c + 1, columns - 1);
    const int low = std::min({low_row_[left], low_row_[c], low_row_[right]});
    const int high = std::max({high_row_[left], high_row_[c], high_row_[right]});
    const auto level =
        high - low < min_range_ ? std::uint8_t{0} : static_cast<std::uint8_t>((low + high + 1) / 2);
    std::fill_n(&levels_[kTile * c], kTile, level);
    contrast[c] = high - low >= edge_range ? 1 : 0;
  }
}

}  // namespace plumbline::vision
