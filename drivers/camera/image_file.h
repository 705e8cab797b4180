// Image file reader for the command line: JPEG with libjpeg, other formats with the OpenCV codec
// module.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "drivers/camera/image_folder.h"
#include "firmware-like/result.h"

namespace plumbline::camera {

/// Reads an image file as luma: PNG, JPEG, BMP, TIFF, PGM and whatever else OpenCV supports. Colour
/// is converted to grey, 16 bits to 8; an orientation tag is ignored. Fails for files above 256 MB
/// or kMaxFilePixels, whose header is checked before they are decoded, for files that are not
/// images, and for a damaged JPEG. The first file that is not a JPEG loads the module, which takes
/// about 0.1 s; if the module cannot be loaded, the call fails.
Result<GreyImage> ReadImage(const std::string& path);

/// Size in the header of a PNG; pure. @return  nullopt if the bytes are not the start of a PNG
struct PngSize {
  std::uint32_t width = 0, height = 0;
};
inline constexpr std::size_t kPngHeaderBytes = 24;
std::optional<PngSize> SizeFromPngHeader(std::string_view bytes);

/// An error if ReadImage() failed because it could not load the codec module: a fault of the
/// installation, not of the images.
Result<void> CheckImageCodecs();

}  // namespace plumbline::camera
