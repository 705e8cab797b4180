// Pixel formats of camera frames and their conversion to luma and BGR. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware-like/image/luma_view.h"
#include "firmware-like/result.h"

namespace plumbline::camera {

/// In order of preference: luma without a copy first, compressed formats last.
enum class PixelFormat : std::uint8_t {
  kGrey,   ///< luma only
  kNv12,   ///< luma plane, then interleaved U and V at half width and height
  kYuyv,   ///< Y U Y V
  kUyvy,   ///< U Y V Y
  kMjpeg,  ///< baseline JPEG, possibly without Huffman tables
  kDv,     ///< DV, decoded by a process of its own: see dv_decoder.h, not by LumaOf() and BgrOf()
};

inline constexpr std::size_t kPixelFormats = 6;
inline constexpr int kMaxImageSide_px = 16384;

/// "GREY", "NV12", "YUYV", "UYVY", "MJPG", "dvsd".
std::string_view PixelFormatName(PixelFormat format);

/// Four-character code as used by the kernel (V4L2_PIX_FMT_..), first character in the lowest byte.
std::uint32_t FourccOf(PixelFormat format);
std::optional<PixelFormat> PixelFormatOfFourcc(std::uint32_t fourcc);
/// Four-character code as text, "?" for unprintable characters.
std::string FourccText(std::uint32_t fourcc);

/// A frame as sent by the camera.
struct RawImage {
  PixelFormat format = PixelFormat::kGrey;
  image::ImageSize size;
  std::ptrdiff_t stride = 0;  ///< bytes from one row to the next; unused for kMjpeg and kDv
  std::span<const std::uint8_t> bytes;
};

/// Luma of `image`. The view refers to the memory of `image` for GREY and NV12, otherwise to
/// `buffer`, which is reused from frame to frame. Fails for DV, a short frame, an impossible size
/// or stride, and a JPEG that is damaged, progressive (unbounded decoding time) or not of
/// `image.size`.
Result<image::LumaView> LumaOf(const RawImage& image, std::vector<std::uint8_t>& buffer);

/// Converts `image` to BGR, 8 bits per channel, row by row without padding. YUV is assumed to be
/// limited-range ITU-R BT.601, the default of cameras that do not report anything else.
/// @return an error in the same cases as LumaOf()
Result<void> BgrOf(const RawImage& image, std::vector<std::uint8_t>& bgr);

}  // namespace plumbline::camera
