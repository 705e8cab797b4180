// Image file reader for the command line: JPEG with libjpeg, other formats with the OpenCV codec
// module.
#pragma once

#include <optional>
#include <string>

#include "drivers/camera/image_folder.h"
#include "firmware-like/result.h"

namespace plumbline::camera {

/// Reads an image file as luma: PNG, JPEG, BMP, TIFF, PGM and whatever else OpenCV supports. Colour
/// is converted to grey, 16 bits to 8; an orientation tag is ignored. Fails for files above 256 MB,
/// for files that are not images, and for a damaged JPEG. The first file that is not a JPEG loads
/// the module, which takes about 0.1 s; if the module cannot be loaded, the call fails.
Result<GreyImage> ReadImage(const std::string& path);

/// An error if ReadImage() failed because it could not load the codec module: a fault of the
/// installation, not of the images.
Result<void> CheckImageCodecs();

}  // namespace plumbline::camera
