// Structure of one DV frame as digital interface (DIF) blocks. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware-like/image/image_size.h"
#include "firmware-like/result.h"

namespace plumbline::camera {

/// Properties of the picture that a frame of the 25 Mbit/s format states.
///
/// A frame has 10 (525 lines, 60 Hz) or 12 (625 lines, 50 Hz) sequences of 150 blocks of 80 bytes:
/// one header block, 2 of subcode, 3 of auxiliary video data, then 9 times one of audio and 15 of
/// video. Each block starts with its identification: section type, sequence and number.
/// [IEC 61834-2, 11; SMPTE 314M, 4]
struct DifFormat {
  bool lines_625 = false;  ///< 720 x 576 at 25 Hz; otherwise 720 x 480 at 29.97 Hz
  bool wide = false;       ///< 16:9 instead of 4:3
  bool operator==(const DifFormat&) const = default;
};

inline constexpr std::size_t kDifBlockBytes = 80;
inline constexpr std::size_t kMaxDifFrameBytes = 144000;
inline constexpr int kDvWidth_px = 720;  ///< not square, see SquareSize()

/// 120,000 or 144,000.
std::size_t DifFrameBytes(bool lines_625);

/// Rows of one of the two fields: 240 or 288.
int FieldRows(const DifFormat& format);

/// Frame rate [Hz].
double FrameRate(const DifFormat& format);

/// Size of the picture with square pixels, rounded: 787 x 576 for pixels of 59:54, 1049 x 576 of
/// 118:81, 655 x 480 of 10:11, 873 x 480 of 40:33. [ITU-R BT.601; SMPTE RP 187]
image::ImageSize SquareSize(const DifFormat& format);

/// Size of the frame that starts with this header block.
/// @param block  at least 80 bytes
/// @return       nullopt if it is not the first block of a frame
std::optional<std::size_t> DifFrameBytesOfHeader(std::span<const std::uint8_t> block);

/// Size of the frame that starts with these bytes.
/// @return nullopt if they are not the 6 blocks of header, subcode and auxiliary data
std::optional<std::size_t> DifFrameBytesOfStart(std::span<const std::uint8_t> bytes);

/// Number of bytes that DifFrameBytesOfStart() needs.
inline constexpr std::size_t kDifStartBytes = 6 * kDifBlockBytes;

/// Checks a whole frame before anything decodes it: its size, the identification of every block,
/// and that the camera marked no video block as wrong or concealed (STA, which is 0 in a picture
/// without faults).
/// @return the format, or what is wrong and where
Result<DifFormat> CheckDifFrame(std::span<const std::uint8_t> bytes);

}  // namespace plumbline::camera
