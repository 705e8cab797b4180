// Pixels as framebuffers have them. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/display/picture.h"
#include "firmware-like/result.h"

namespace plumbline {

/// Where one colour lies in a pixel's word, counted from the lowest bit.
struct ColourBits {
  unsigned offset = 0, length = 8;
  bool operator==(const ColourBits&) const = default;
};

/// How a framebuffer holds its pixels: words of 16 or 32 bits in the computer's byte order.
struct PixelLayout {
  ImageSize size;
  std::size_t stride = 0;  ///< bytes from one row to the next
  unsigned bits = 32;      ///< of one pixel
  ColourBits red{16, 8}, green{8, 8}, blue{0, 8};
  bool operator==(const PixelLayout&) const = default;
};

/// What of a layout is not known here, or does not fit into `memory_bytes`.
std::optional<Error> UnusableLayout(const PixelLayout& layout, std::size_t memory_bytes);

/// Writes a picture of the layout's size into memory of that layout; each colour is rounded to the
/// bits it has. What lies between the rows is left alone.
/// @param memory  as large as UnusableLayout() was told
void PackPicture(const PictureView& picture, const PixelLayout& layout,
                 std::span<std::uint8_t> memory);
/// The same, from where it was drawn.
void PackDrawn(DrawnPicture& picture, const PixelLayout& layout, std::span<std::uint8_t> memory);

}  // namespace plumbline
