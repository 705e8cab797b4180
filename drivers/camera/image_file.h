// One image from a file of any kind, by OpenCV, JPEG by libjpeg: for the command line.
#pragma once

#include <string>

#include "drivers/camera/image_folder.h"
#include "firmware-like/result.h"

namespace plumbline {

/// Reads an image file as luma: PNG, JPEG, BMP, TIFF, PGM and what else OpenCV reads; colour is
/// turned to grey, 16 bits to 8. Pixels stand as in the file, whatever orientation it tells beside
/// them. Refused are files beyond 256 MB, what is no image, and a damaged JPEG.
Result<GreyImage> ReadImage(const std::string& path);

}  // namespace plumbline
