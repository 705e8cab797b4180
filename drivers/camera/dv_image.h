// DV (IEC 61834, SMPTE 314M, 25 Mbit/s) by libdv: frames of camcorders and older cell cameras.
// Pure.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "firmware-like/lens/lens.h"
#include "firmware-like/result.h"

namespace plumbline {

/// Decodes a frame of 144000 bytes (720 x 576 px, 25 Hz) or 120000 bytes (720 x 480 px, 29.97 Hz)
/// into Y U Y V, rows without padding. DV is interlaced, its two fields 20 or 16.7 ms apart: the
/// lines of one field are kept, those between are the mean of their neighbours, so that what moves
/// is not torn, at half the resolution along the image's height. A lens calibrated on such images
/// belongs to them. Pixels are not square; fx and fy differ by that.
///
/// Refused: an image of another size, a frame that is short, whose blocks stand in another order
/// than the standard's, or in which the camera marked a block as damaged.
/// @return why there are no pixels; `yuyv` is then of no use
std::optional<Error> DecodeDv(std::span<const std::uint8_t> bytes, ImageSize size,
                              std::vector<std::uint8_t>& yuyv);

}  // namespace plumbline
