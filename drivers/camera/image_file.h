// One image from a file of any kind, by OpenCV: for the command line.
#pragma once

#include <string>

#include "drivers/camera/image_folder.h"
#include "firmware-like/result.h"

namespace plumbline {

/// Reads an image file as luma: PNG, JPEG, BMP, TIFF, PGM and what else OpenCV reads; colour is
/// turned to grey, 16 bits to 8. Refused are files beyond 256 MB and what is no image.
Result<GreyImage> ReadImage(const std::string& path);

}  // namespace plumbline
