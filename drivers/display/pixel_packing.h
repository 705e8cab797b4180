// Conversion of pictures to the pixel layouts of framebuffers. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/display/picture.h"
#include "firmware-like/image/image_size.h"
#include "firmware-like/result.h"

namespace plumbline::display {

/// Bit field of one colour in a pixel word; the offset counts from the lowest bit.
struct ColourBits {
  unsigned offset = 0, length = 8;
  bool operator==(const ColourBits&) const = default;
};

/// Pixel layout of a framebuffer: words of 16 or 32 bits in native byte order.
struct PixelLayout {
  image::ImageSize size;
  std::size_t stride = 0;  ///< bytes from one row to the next
  unsigned bits = 32;      ///< bits per pixel
  ColourBits red{16, 8}, green{8, 8}, blue{0, 8};
  bool operator==(const PixelLayout&) const = default;
};

/// Checks that a layout is supported and fits into `memory_bytes`.
Result<void> CheckLayout(const PixelLayout& layout, std::size_t memory_bytes);

/// Writes a picture of the layout's size into `memory`; each colour is rounded to its bits. Padding
/// between the rows is left unchanged.
/// @param memory  at least as large as passed to CheckLayout()
void PackPicture(const PictureView& picture, const PixelLayout& layout,
                 std::span<std::uint8_t> memory);
/// Same, reading the picture from the renderer.
void PackDrawn(DrawnPicture& picture, const PixelLayout& layout, std::span<std::uint8_t> memory);

}  // namespace plumbline::display
