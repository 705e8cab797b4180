// Which pixels are dark: the image made smaller, and a threshold for each place of it.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "firmware-like/lens/luma_view.h"

namespace plumbline {

/// A part of an image: columns u0 <= u < u1, rows v0 <= v < v1.
struct ImageBox {
  int u0 = 0, v0 = 0, u1 = 0, v1 = 0;

  int width() const { return u1 - u0; }
  int height() const { return v1 - v0; }
};

/// The part of `box` that lies in an image of that size.
ImageBox WithinImage(const ImageBox& box, ImageSize size);

/// A part of the image with less noise: each pixel the mean of 2 x 2 (shrink 2), or the binomial
/// mean 1-2-1 in both directions at full size (shrink 1).
struct SearchImage {
  int width = 0, height = 0;
  int shrink = 2;
  int u0 = 0, v0 = 0;  ///< the image's pixel at its top left
  std::vector<std::uint8_t> grey, dark;

  /// Pixel of the whole image at (x, y) of this one; both count from pixel centres.
  Vec2 ImagePixel(double x, double y) const {
    const double half = 0.5 * (shrink - 1);
    return {u0 + shrink * x + half, v0 + shrink * y + half};
  }
};

/// Fills `search` with a part of the image.
void MakeSearchImage(const LumaView& image, const ImageBox& box, int shrink, SearchImage& search);

/// How dark is told from bright.
class Threshold {
 public:
  /// @param fixed  pixels below this grey level are dark (0..255); without it, those below the
  ///               middle between the darkest and the brightest of the tiles around them
  explicit Threshold(std::optional<int> fixed) : fixed_(fixed) {}

  /// Fills search.dark with 1 (dark) and 0. Where the light hardly changes within three tiles of 4
  /// x 4 pixels, nothing is dark: the range there must be kRangeInNoise times the noise, which the
  /// flattest fifth of the tiles tells. In a small part of an image the tag itself may leave no
  /// flat tile: there the range of the last whole image counts if it is less.
  void Apply(SearchImage& search, bool whole_image);

  /// The range that counted as an edge in the last image [grey levels].
  int least_range() const { return least_range_; }

 private:
  void MeasureTiles(const SearchImage& search);
  int LeastRange() const;

  std::optional<int> fixed_;
  int columns_ = 0, rows_ = 0;
  int least_range_ = 255;
  std::vector<std::uint8_t> lowest_, highest_, level_;  ///< by tile
};

}  // namespace plumbline
