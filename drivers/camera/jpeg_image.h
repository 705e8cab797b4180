// JPEG by libjpeg: frames that a camera sent, and files. Pure, and silent: what libjpeg would print
// is told.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "drivers/camera/image_folder.h"
#include "firmware-like/lens/lens.h"
#include "firmware-like/result.h"

namespace plumbline {

enum class JpegColour : std::uint8_t {
  kLuma,  ///< one byte a pixel; the chroma is not decoded
  kBgr,   ///< three bytes a pixel
};

/// Decodes `bytes` into `pixels`, row by row without padding. Tables that cameras leave out are the
/// standard's (ITU-T T.81, annex K.3). Refused: an image of another size, progressive and
/// arithmetic coding, any damage (libjpeg would go on and paint something grey); bytes too many
/// between the parts of the file are passed over, since many cameras send some.
/// @return why there are no pixels; `pixels` is then of no use
Result<void> DecodeJpeg(std::span<const std::uint8_t> bytes, ImageSize size, JpegColour colour,
                        std::vector<std::uint8_t>& pixels);

/// Decodes a file as luma, of any kind that libjpeg reads (progressive ones too) up to 100
/// megapixels. Pixels stand as they do in the file: an orientation told beside them is not applied,
/// since a lens belongs to the sensor. Damage is refused as above.
/// @return why there are no pixels; `image` is then of no use
Result<void> DecodeJpegFile(std::span<const std::uint8_t> bytes, GreyImage& image);

}  // namespace plumbline
