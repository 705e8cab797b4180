#include "drivers/camera/pixel_format.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "drivers/camera/jpeg_image.h"

namespace plumbline {
namespace {

struct Named {
  PixelFormat format;
  std::string_view name;
};

constexpr std::array<Named, kPixelFormats> kNames = {{
    {PixelFormat::kGrey, "GREY"},
    {PixelFormat::kNv12, "NV12"},
    {PixelFormat::kYuyv, "YUYV"},
    {PixelFormat::kUyvy, "UYVY"},
    {PixelFormat::kMjpeg, "MJPG"},
}};

bool IsPacked(PixelFormat format) {
  return format == PixelFormat::kYuyv || format == PixelFormat::kUyvy;
}

/// Why these bytes are no image of that size, or nothing. Not for kMjpeg.
std::optional<Error> LayoutFault(const RawImage& image) {
  const auto [width, height] = image.size;
  const bool is_yuv = image.format != PixelFormat::kGrey;
  if (width < 1 || height < 1 || width > kLargestImageSide_px || height > kLargestImageSide_px ||
      (is_yuv && width % 2 != 0) || (image.format == PixelFormat::kNv12 && height % 2 != 0)) {
    return Error{fmt::format("{} of {} x {} px is not possible", PixelFormatName(image.format),
                             width, height)};
  }
  const std::ptrdiff_t row = IsPacked(image.format) ? 2 * width : width;
  if (image.stride < row || image.stride > 64 * kLargestImageSide_px) {
    return Error{fmt::format("{} bytes a row of {} px are not possible", image.stride, width)};
  }
  const std::ptrdiff_t rows = image.format == PixelFormat::kNv12 ? height + height / 2 : height;
  const std::ptrdiff_t needed = (rows - 1) * image.stride + row;
  if (static_cast<std::ptrdiff_t>(image.bytes.size()) < needed) {
    return Error{fmt::format("a short frame: {} bytes where {} x {} px {} have {}",
                             image.bytes.size(), width, height, PixelFormatName(image.format),
                             needed)};
  }
  return std::nullopt;
}

std::uint8_t Byte(int value) {
  return static_cast<std::uint8_t>(std::clamp(value, 0, 255));
}

/// One pixel of limited range by ITU-R BT.601, in 1/256:
///   R = 1.164 (Y-16) + 1.596 (V-128)
///   G = 1.164 (Y-16) - 0.391 (U-128) - 0.813 (V-128)
///   B = 1.164 (Y-16) + 2.018 (U-128)
void PutBgr(int y, int u, int v, std::uint8_t* bgr) {
  const int luma = 298 * (y - 16) + 128;
  bgr[0] = Byte((luma + 517 * (u - 128)) / 256);
  bgr[1] = Byte((luma - 100 * (u - 128) - 208 * (v - 128)) / 256);
  bgr[2] = Byte((luma + 409 * (v - 128)) / 256);
}

/// Row v of an image whose layout is sound.
void PutBgrRow(const RawImage& image, int v, std::uint8_t* bgr) {
  const std::uint8_t* row = image.bytes.data() + v * image.stride;
  const std::uint8_t* chroma = image.bytes.data() + (image.size.height + v / 2) * image.stride;
  for (int x = 0; x < image.size.width; x += 2, bgr += 6) {
    const std::uint8_t* pair = row + 2 * x;
    switch (image.format) {
      case PixelFormat::kNv12:
        PutBgr(row[x], chroma[x], chroma[x + 1], bgr);
        PutBgr(row[x + 1], chroma[x], chroma[x + 1], bgr + 3);
        break;
      case PixelFormat::kYuyv:
        PutBgr(pair[0], pair[1], pair[3], bgr);
        PutBgr(pair[2], pair[1], pair[3], bgr + 3);
        break;
      case PixelFormat::kUyvy:
        PutBgr(pair[1], pair[0], pair[2], bgr);
        PutBgr(pair[3], pair[0], pair[2], bgr + 3);
        break;
      case PixelFormat::kGrey:
      case PixelFormat::kMjpeg:
        break;
    }
  }
}

}  // namespace

std::string_view PixelFormatName(PixelFormat format) {
  for (const Named& known : kNames) {
    if (known.format == format) return known.name;
  }
  return "?";
}

std::optional<PixelFormat> PixelFormatOfName(std::string_view name) {
  for (const Named& known : kNames) {
    if (known.name == name) return known.format;
  }
  return std::nullopt;
}

std::uint32_t FourccOf(PixelFormat format) {
  std::uint32_t fourcc = 0;
  int shift = 0;
  for (const char letter : PixelFormatName(format)) {
    fourcc |= static_cast<std::uint32_t>(static_cast<unsigned char>(letter)) << shift;
    shift += 8;
  }
  return fourcc;
}

std::optional<PixelFormat> PixelFormatOfFourcc(std::uint32_t fourcc) {
  for (const Named& known : kNames) {
    if (FourccOf(known.format) == fourcc) return known.format;
  }
  return std::nullopt;
}

std::string FourccText(std::uint32_t fourcc) {
  std::string text;
  for (int shift = 0; shift < 32; shift += 8) {
    const auto letter = static_cast<char>((fourcc >> shift) & 0xFF);
    text += letter >= ' ' && letter <= '~' ? letter : '?';
  }
  return text;
}

Result<LumaView> LumaOf(const RawImage& image, std::vector<std::uint8_t>& buffer) {
  const auto [width, height] = image.size;
  if (image.format == PixelFormat::kMjpeg) {
    if (auto why = DecodeJpeg(image.bytes, image.size, JpegColour::kLuma, buffer)) return *why;
    return LumaView{buffer.data(), width, height, width};
  }
  if (const auto why = LayoutFault(image)) return *why;
  if (!IsPacked(image.format)) return LumaView{image.bytes.data(), width, height, image.stride};
  buffer.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const std::size_t first = image.format == PixelFormat::kYuyv ? 0 : 1;
  for (int v = 0; v < height; ++v) {
    const std::uint8_t* from = image.bytes.data() + v * image.stride;
    std::uint8_t* to = buffer.data() + static_cast<std::ptrdiff_t>(v) * width;
    for (int x = 0; x < width; ++x) to[x] = from[2 * static_cast<std::size_t>(x) + first];
  }
  return LumaView{buffer.data(), width, height, width};
}

std::optional<Error> BgrOf(const RawImage& image, std::vector<std::uint8_t>& bgr) {
  if (image.format == PixelFormat::kMjpeg) {
    return DecodeJpeg(image.bytes, image.size, JpegColour::kBgr, bgr);
  }
  if (auto why = LayoutFault(image)) return why;
  const auto [width, height] = image.size;
  bgr.resize(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int v = 0; v < height; ++v) {
    std::uint8_t* to = bgr.data() + static_cast<std::ptrdiff_t>(3) * v * width;
    if (image.format != PixelFormat::kGrey) {
      PutBgrRow(image, v, to);
      continue;
    }
    const std::uint8_t* from = image.bytes.data() + v * image.stride;
    for (int x = 0; x < 3 * width; ++x) to[x] = from[x / 3];
  }
  return std::nullopt;
}

}  // namespace plumbline
