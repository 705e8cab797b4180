// Loadable module with OpenCV's image codecs: interface and loader.
//
// OpenCV's imgcodecs depends on about a hundred shared libraries, which would cost every program
// linked with it 0.1 s at start-up and 40 MB. The module is loaded when the first image needs it.
#pragma once

#include <cstdint>
#include <string>

#include "firmware-like/result.h"

namespace plumbline::camera {

/// Callback that receives a decoded image: luma, 8 bits, row by row, no padding. The pixels are
/// owned by the module and valid during the call only.
using TakeGreyImage = void(void* image, int width, int height, const std::uint8_t* grey);

/// Decodes the image file `path` and passes it to `take` together with `image`, once.
/// @return  nullptr, or why the file cannot be read: a string literal of the module
using ReadGreyImage = const char*(const char* path, TakeGreyImage* take, void* image);

/// File name of the module, and name of its function of type ReadGreyImage. The number is the
/// version of this interface, so that a module of another version is rejected instead of called.
inline constexpr const char* kImageCodecsFile = "plumbline-image-codecs.so";
inline constexpr const char* kReadGreyImageName = "plumbline_read_grey_image_1";

/// Functions of a loaded module.
struct ImageCodecs {
  ReadGreyImage* read_grey;
};

/// Loads the module at `path`; it stays loaded until the program ends.
/// @return  its functions, or which library is missing, the consequence and the remedy
Result<ImageCodecs> OpenImageCodecs(const std::string& path);

}  // namespace plumbline::camera
