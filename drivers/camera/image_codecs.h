// The loadable module that holds OpenCV's image codecs: its interface, and how it is opened.
//
// OpenCV's imgcodecs brings about a hundred shared libraries, which a program linked with it maps
// and relocates at every start: 0.1 s or more, and 40 MB. The module is opened when the first image
// that needs it is read.
#pragma once

#include <cstdint>
#include <string>

#include "firmware-like/result.h"

namespace plumbline {

/// Takes the pixels of a decoded image: luma, 8 bits, row by row, no padding. They are the module's
/// and end with the call.
using TakeGreyImage = void(void* image, int width, int height, const std::uint8_t* grey);

/// Reads the image file `path` and hands it to `take` with `image`, once.
/// @return  null, or why the file cannot be read: a literal of the module
using ReadGreyImage = const char*(const char* path, TakeGreyImage* take, void* image);

/// The module's file, and the function of type ReadGreyImage in it. The number counts the versions
/// of this interface, so that a module of another version is refused and not called.
inline constexpr const char* kImageCodecsFile = "plumbline-image-codecs.so";
inline constexpr const char* kReadGreyImageName = "plumbline_read_grey_image_1";

/// The functions of a module that is open.
struct ImageCodecs {
  ReadGreyImage* read_grey;
};

/// Opens the module at `path`; it stays open until the program ends.
/// @return  its functions; or which library is missing, what that means, and what to do
Result<ImageCodecs> OpenImageCodecs(const std::string& path);

}  // namespace plumbline
