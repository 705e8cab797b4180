// JPEG decoder on libjpeg, for camera frames and files. Pure; errors are returned, never printed.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "drivers/camera/image_folder.h"
#include "firmware-like/image/image_size.h"
#include "firmware-like/lens/lens.h"
#include "firmware-like/result.h"

namespace plumbline::camera {

enum class JpegColour : std::uint8_t {
  kLuma,  ///< one byte per pixel; chroma is not decoded
  kBgr,   ///< three bytes per pixel
};

/// Decodes `bytes` into `pixels`, row by row without padding. If the camera omits the Huffman
/// tables, those of the standard (ITU-T T.81, annex K.3) are used. Fails for another image size,
/// for progressive or arithmetic coding, and for any damage (libjpeg would fill the rest with
/// grey). Extra bytes between segments are ignored, since many cameras send some.
/// @return an error if there are no pixels; the contents of `pixels` are then unspecified
Result<void> DecodeJpeg(std::span<const std::uint8_t> bytes, image::ImageSize size,
                        JpegColour colour, std::vector<std::uint8_t>& pixels);

/// Decodes a JPEG file of any kind that libjpeg supports, including progressive, as luma, up to 100
/// megapixels. An orientation tag is not applied, because a lens model refers to the sensor. Fails
/// for damage as above.
/// @return an error if there are no pixels; the contents of `image` are then unspecified
Result<void> DecodeJpegFile(std::span<const std::uint8_t> bytes, GreyImage& image);

}  // namespace plumbline::camera
