#include "drivers/camera/pixel_format.h"

#include <fmt/format.h>

#include <array>
#include <opencv2/imgproc.hpp>

#include "drivers/camera/jpeg_image.h"

namespace plumbline::camera {
namespace {

constexpr std::ptrdiff_t kMaxRowBytes = std::ptrdiff_t{64} * kMaxImageSide_px;

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
    {PixelFormat::kDv, "dvsd"},
}};

bool IsPacked(PixelFormat format) {
  return format == PixelFormat::kYuyv || format == PixelFormat::kUyvy;
}

/// Checks that the bytes can be an image of that size. Not for kMjpeg.
Result<void> CheckLayout(const RawImage& image) {
  const auto [width, height] = image.size;
  if (image.format == PixelFormat::kDv) return Error{"DV is decoded by plumbline-dv only"};
  const bool is_yuv = image.format != PixelFormat::kGrey;
  if (width < 1 || height < 1 || width > kMaxImageSide_px || height > kMaxImageSide_px ||
      (is_yuv && width % 2 != 0) || (image.format == PixelFormat::kNv12 && height % 2 != 0)) {
    return Error{fmt::format("{} of {} x {} px is not possible", PixelFormatName(image.format),
                             width, height)};
  }
  const std::ptrdiff_t row = IsPacked(image.format) ? 2 * width : width;
  if (image.stride < row || image.stride > kMaxRowBytes) {
    return Error{
        fmt::format("a stride of {} bytes is not possible for {} px", image.stride, width)};
  }
  const std::ptrdiff_t rows = image.format == PixelFormat::kNv12 ? height + height / 2 : height;
  const std::ptrdiff_t needed = (rows - 1) * image.stride + row;
  if (static_cast<std::ptrdiff_t>(image.bytes.size()) < needed) {
    return Error{fmt::format("a short frame: {} bytes, but {} x {} px in {} need {}",
                             image.bytes.size(), width, height, PixelFormatName(image.format),
                             needed)};
  }
  return {};
}

}  // namespace

std::string_view PixelFormatName(PixelFormat format) {
  for (const Named& known : kNames) {
    if (known.format == format) return known.name;
  }
  return "?";
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

Result<image::LumaView> LumaOf(const RawImage& image, std::vector<std::uint8_t>& buffer) {
  const auto [width, height] = image.size;
  if (image.format == PixelFormat::kMjpeg) {
    const auto decoded = DecodeJpeg(image.bytes, image.size, JpegColour::kLuma, buffer);
    if (!decoded) return decoded.failure();
    return image::LumaView{buffer.data(), width, height, width};
  }
  if (const Result<void> valid = CheckLayout(image); !valid) return valid.failure();
  if (!IsPacked(image.format))
    return image::LumaView{image.bytes.data(), width, height, image.stride};
  buffer.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const std::size_t first = image.format == PixelFormat::kYuyv ? 0 : 1;
  for (int v = 0; v < height; ++v) {
    const std::uint8_t* from = image.bytes.data() + v * image.stride;
    std::uint8_t* to = buffer.data() + static_cast<std::ptrdiff_t>(v) * width;
    for (int x = 0; x < width; ++x) to[x] = from[2 * static_cast<std::size_t>(x) + first];
  }
  return image::LumaView{buffer.data(), width, height, width};
}

Result<void> BgrOf(const RawImage& image, std::vector<std::uint8_t>& bgr) {
  if (image.format == PixelFormat::kMjpeg) {
    return DecodeJpeg(image.bytes, image.size, JpegColour::kBgr, bgr);
  }
  if (const Result<void> valid = CheckLayout(image); !valid) return valid.failure();
  const auto [width, height] = image.size;
  bgr.resize(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  // cv::Mat has no const constructor; the data is only read.
  auto* const bytes = const_cast<std::uint8_t*>(image.bytes.data());
  const auto stride = static_cast<std::size_t>(image.stride);
  const cv::Mat first(height, width, IsPacked(image.format) ? CV_8UC2 : CV_8UC1, bytes, stride);
  cv::Mat to(height, width, CV_8UC3, bgr.data());
  switch (image.format) {
    case PixelFormat::kGrey:
      cv::cvtColor(first, to, cv::COLOR_GRAY2BGR);
      break;
    case PixelFormat::kNv12: {
      const cv::Mat chroma(height / 2, width / 2, CV_8UC2, bytes + height * image.stride, stride);
      cv::cvtColorTwoPlane(first, chroma, to, cv::COLOR_YUV2BGR_NV12);
      break;
    }
    case PixelFormat::kYuyv:
      cv::cvtColor(first, to, cv::COLOR_YUV2BGR_YUYV);
      break;
    case PixelFormat::kUyvy:
      cv::cvtColor(first, to, cv::COLOR_YUV2BGR_UYVY);
      break;
    case PixelFormat::kMjpeg:
    case PixelFormat::kDv:
      break;
  }
  return {};
}

}  // namespace plumbline::camera
