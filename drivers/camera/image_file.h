// One image from a file of any kind: JPEG by libjpeg, others by the module of OpenCV's codecs. For
// the command line.
#pragma once

#include <optional>
#include <string>

#include "drivers/camera/image_folder.h"
#include "firmware-like/result.h"

namespace plumbline {

/// Reads an image file as luma: PNG, JPEG, BMP, TIFF, PGM and what else OpenCV reads; colour is
/// turned to grey, 16 bits to 8. Pixels stand as in the file, whatever orientation it tells beside
/// them. Refused are files beyond 256 MB, what is no image, and a damaged JPEG. The first file that
/// is no JPEG opens the module, which takes about 0.1 s; if that fails, the error says so.
Result<GreyImage> ReadImage(const std::string& path);

/// Why ReadImage() could not open the module of codecs, where it refused an image for that: a fault
/// of the installation and not of the images. Nothing otherwise.
std::optional<Error> MissingImageCodecs();

}  // namespace plumbline
