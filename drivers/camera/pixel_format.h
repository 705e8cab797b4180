// What the bytes of a camera's frame mean. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware-like/lens/luma_view.h"
#include "firmware-like/result.h"

namespace plumbline {

/// In the order in which they are preferred: whose luma needs no copy, no compression.
enum class PixelFormat : std::uint8_t {
  kGrey,   ///< luma alone
  kNv12,   ///< luma, then U and V alternating at half the width and height
  kYuyv,   ///< Y U Y V
  kUyvy,   ///< U Y V Y
  kMjpeg,  ///< a baseline JPEG file, also without its Huffman tables
};

inline constexpr std::size_t kPixelFormats = 5;
inline constexpr int kLargestImageSide_px = 16384;

/// "GREY", "NV12", "YUYV", "UYVY", "MJPG".
std::string_view PixelFormatName(PixelFormat format);
std::optional<PixelFormat> PixelFormatOfName(std::string_view name);

/// The kernel's four letters in one number (V4L2_PIX_FMT_..), first letter lowest.
std::uint32_t FourccOf(PixelFormat format);
std::optional<PixelFormat> PixelFormatOfFourcc(std::uint32_t fourcc);
/// Four letters as text, "?" for what is no letter.
std::string FourccText(std::uint32_t fourcc);

/// A frame as the camera sent it.
struct RawImage {
  PixelFormat format = PixelFormat::kGrey;
  ImageSize size;
  std::ptrdiff_t stride = 0;  ///< bytes from one row to the next; nothing for kMjpeg
  std::span<const std::uint8_t> bytes;
};

/// Luma of `image`: its own memory for GREY and NV12, else `buffer`, which keeps its memory from
/// frame to frame. Refused, with the reason: a short frame, a size or stride that cannot be, a JPEG
/// that is damaged, progressive (its time has no bound) or of another size than `image.size`.
Result<LumaView> LumaOf(const RawImage& image, std::vector<std::uint8_t>& buffer);

/// Blue, green, red, 8 bits each, row by row without padding, into `bgr`. YUV of limited range is
/// taken to be ITU-R BT.601, as cameras that do not say otherwise send it.
/// @return why it cannot be done, as above
Result<void> BgrOf(const RawImage& image, std::vector<std::uint8_t>& bgr);

}  // namespace plumbline
