// Reduction of the image and adaptive thresholding into dark and bright pixels.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "firmware-like/image/luma_view.h"
#include "firmware-like/lens/lens.h"

namespace plumbline::vision {

/// A part of an image: columns u0 <= u < u1, rows v0 <= v < v1.
struct ImageBox {
  int u0 = 0, v0 = 0, u1 = 0, v1 = 0;

  int width() const { return u1 - u0; }
  int height() const { return v1 - v0; }
};

/// The intersection of `box` with an image of that size.
ImageBox WithinImage(const ImageBox& box, image::ImageSize size);

/// How a part of the image is prepared for the search.
enum class Reduction : std::uint8_t {
  kHalf,    ///< means of 2 x 2 pixels
  kSmooth,  ///< full resolution, with a binomial 1-2-1 filter in both directions: for noisy images
  kNone,    ///< the pixels themselves: for tags whose cells are hardly larger than a pixel
};

/// A part of the image at half (shrink 2) or full resolution (shrink 1).
struct SearchImage {
  static constexpr int kTile = 4;  ///< side of a tile [px]

  int width = 0, height = 0;
  int shrink = 2;
  int u0 = 0, v0 = 0;  ///< pixel of the full image at its top left
  std::vector<std::uint8_t> grey, dark;
  std::vector<std::uint8_t> contrast;  ///< by tile: 1 where the grey levels vary

  int tile_columns() const { return (width + kTile - 1) / kTile; }

  /// The inverse of ImagePixel.
  lens::Vec2 PixelOf(const lens::Vec2& image_px) const {
    const double half = 0.5 * (shrink - 1);
    return {(image_px.x() - half - u0) / shrink, (image_px.y() - half - v0) / shrink};
  }
  /// The lens of the full image, for pixels of this one.
  lens::Lens LensOf(const lens::Lens& lens) const;

  /// Position in the full image of (x, y) in this one; in both, pixel centres have integer
  /// coordinates.
  lens::Vec2 ImagePixel(double x, double y) const {
    const double half = 0.5 * (shrink - 1);
    return {u0 + shrink * x + half, v0 + shrink * y + half};
  }
};

/// Fills `search` with a part of the image.
void MakeSearchImage(const image::LumaView& image, const ImageBox& box, Reduction reduction,
                     SearchImage& search);

/// Halves a search image: the means of 2 x 2 pixels. Only the grey levels are filled.
void MakeCoarser(const SearchImage& search, SearchImage& coarser);

/// Classifies pixels as dark or bright.
class Threshold {
 public:
  /// @param fixed  grey level below which a pixel is dark (0..255); if nullopt, it is halfway
  ///               between the darkest and the brightest pixel of the surrounding tiles
  explicit Threshold(std::optional<int> fixed) : fixed_(fixed) {}

  /// Fills search.dark with 1 (dark) and 0. Nothing is dark where the grey levels within three by
  /// three tiles of 4 x 4 pixels hardly vary: their range must be kRangeInNoise times the noise,
  /// which is estimated from the flattest fifth of the tiles. A small part of an image may be
  /// filled by a tag and have no flat tile, so the range of the last full image is used there if it
  /// is smaller.
  void Apply(SearchImage& search, bool whole_image);

  /// Smallest range that counted as an edge in the last image [grey levels].
  int min_range() const { return min_range_; }
  /// Range that noise alone hardly ever reaches anywhere in an image [grey levels].
  int edge_range() const { return min_range_ + min_range_ / 4; }

 private:
  void MeasureTiles(const SearchImage& search);
  void SetLevels(int tile_row, std::uint8_t* contrast);
  int MinRange() const;

  std::optional<int> fixed_;
  int columns_ = 0, rows_ = 0;
  int min_range_ = 255;
  std::vector<std::uint8_t> lowest_, highest_;             ///< by tile
  std::vector<std::uint8_t> low_row_, high_row_, levels_;  ///< of one row of tiles, by column
};

}  // namespace plumbline::vision
