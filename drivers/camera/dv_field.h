// Codec of the response of plumbline-dv, and conversion of its field to a picture with square
// pixels. Pure.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "drivers/camera/dif_frame.h"
#include "firmware-like/image/luma_view.h"

namespace plumbline::camera {

/// Exit codes of plumbline-dv.
inline constexpr int kDvNoLibrary = 3, kDvNoSandbox = 4;

/// Start of an answer. `rows` rows of 720 pixels as Y U Y V follow; none if the frame is damaged.
struct DvAnswerHeader {
  std::uint32_t magic = kMagic;
  std::uint32_t rows = 0;
  static constexpr std::uint32_t kMagic = 0x31564450;  ///< "PDV1"
};

inline constexpr std::size_t kDvRowBytes = std::size_t{2} * kDvWidth_px;

/// Number of bytes that follow the header of an answer. A malicious frame may have compromised
/// plumbline-dv, so the answer is untrusted: it is accepted only if its size is that of the frame's
/// field.
/// @return  0 if the frame is damaged; nullopt if this is not an answer
std::optional<std::size_t> DvAnswerBytes(
    const std::array<std::uint8_t, sizeof(DvAnswerHeader)>& header, const DifFormat& format);

/// One field of a frame: every other line, all sampled at the same time.
struct DvField {
  std::span<const std::uint8_t> yuyv;  ///< FieldRows() rows of kDvRowBytes
  DifFormat format;
};

/// Interpolates the field linearly to SquareSize(). Row r of the field is line 2 r + 1 of the
/// frame; the picture is shifted by half a line against it, which a calibrated lens absorbs.
/// @param field_luma, buffer  memory that is reused from frame to frame
image::LumaView SquareLuma(const DvField& field, std::vector<std::uint8_t>& field_luma,
                           std::vector<std::uint8_t>& buffer);

/// The same in colour: BGR, 8 bits per channel, from ITU-R BT.601 with limited range.
void SquareBgr(const DvField& field, std::vector<std::uint8_t>& bgr);

}  // namespace plumbline::camera
