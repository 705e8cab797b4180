#include "drivers/display/pixel_packing.h"

#include <fmt/format.h>

#include <array>
#include <cstring>

namespace plumbline::display {
namespace {

using ColourTable = std::array<std::uint32_t, 256>;

/// Shifted bit field for each value of a colour.
ColourTable TableOf(const ColourBits& colour) {
  ColourTable table{};
  const std::uint32_t most = (1U << colour.length) - 1;
  for (std::uint32_t value = 0; value < 256; ++value) {
    table[value] = (value * most + 127) / 255 << colour.offset;
  }
  return table;
}

template <typename Word>
void PackRows(const PictureView& picture, const PixelLayout& layout, std::uint8_t* memory) {
  const ColourTable red = TableOf(layout.red), green = TableOf(layout.green),
                    blue = TableOf(layout.blue);
  for (int v = 0; v < layout.size.height; ++v) {
    const std::uint8_t* from = picture.row(v);
    std::uint8_t* to = memory + static_cast<std::size_t>(v) * layout.stride;
    for (int u = 0; u < layout.size.width; ++u, from += 4, to += sizeof(Word)) {
      const auto word = static_cast<Word>(red[from[0]] | green[from[1]] | blue[from[2]]);
      std::memcpy(to, &word, sizeof word);
    }
  }
}

/// The common 8-8-8 layout without tables, so that the compiler can vectorise it.
void PackRows8888(const PictureView& picture, const PixelLayout& layout, std::uint8_t* memory) {
  const unsigned red = layout.red.offset, green = layout.green.offset, blue = layout.blue.offset;
  for (int v = 0; v < layout.size.height; ++v) {
    const std::uint8_t* from = picture.row(v);
    std::uint8_t* to = memory + static_cast<std::size_t>(v) * layout.stride;
    for (int u = 0; u < layout.size.width; ++u) {
      std::uint32_t pixel = 0;
      std::memcpy(&pixel, from + std::ptrdiff_t{4} * u, sizeof pixel);
      const std::uint32_t word =
          (pixel & 0xFFU) << red | (pixel >> 8U & 0xFFU) << green | (pixel >> 16U & 0xFFU) << blue;
      std::memcpy(to + std::ptrdiff_t{4} * u, &word, sizeof word);
    }
  }
}

}  // namespace

Result<void> CheckLayout(const PixelLayout& layout, std::size_t memory_bytes) {
  const auto& [width, height] = layout.size;
  if (layout.bits != 16 && layout.bits != 32) {
    return Error{
        fmt::format("{} bits per pixel, which is not supported; 16 and 32 are", layout.bits)};
  }
  if (width < 1 || height < 1 || width > 16384 || height > 16384) {
    return Error{fmt::format("a size of {} x {} pixels", width, height)};
  }
  for (const ColourBits& colour : {layout.red, layout.green, layout.blue}) {
    if (colour.length < 1 || colour.length > 10 || colour.offset > layout.bits - colour.length) {
      return Error{"colours outside the bits of a pixel"};
    }
  }
  const std::size_t row_bytes = static_cast<std::size_t>(width) * layout.bits / 8;
  const auto rows = static_cast<std::size_t>(height);
  if (layout.stride < row_bytes || memory_bytes < row_bytes ||
      (memory_bytes - row_bytes) / layout.stride < rows - 1) {
    return Error{"rows that exceed its memory"};
  }
  return {};
}

void PackPicture(const PictureView& picture, const PixelLayout& layout,
                 std::span<std::uint8_t> memory) {
  const bool bytes = layout.red.length == 8 && layout.green.length == 8 && layout.blue.length == 8;
  if (layout.bits == 16) {
    PackRows<std::uint16_t>(picture, layout, memory.data());
  } else if (bytes) {
    PackRows8888(picture, layout, memory.data());
  } else {
    PackRows<std::uint32_t>(picture, layout, memory.data());
  }
}

void PackDrawn(DrawnPicture& picture, const PixelLayout& layout, std::span<std::uint8_t> memory) {
  ReadInStrips(picture, [&](int first, const PictureView& rows) {
    PixelLayout part = layout;
    part.size = rows.size;
    PackPicture(rows, part, memory.subspan(static_cast<std::size_t>(first) * layout.stride));
  });
}

}  // namespace plumbline::display
