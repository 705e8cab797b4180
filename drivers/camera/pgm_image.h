// Portable grey maps: the images of a recording that a daemon plays.
#pragma once

#include <string>
#include <string_view>

#include "drivers/camera/image_folder.h"
#include "firmware-like/result.h"

namespace plumbline {

/// A binary PGM of 8 bits: "P5", width, height and 255 as text with comments, one white space, the
/// pixels row by row. Bytes after them are passed over. Pure.
Result<GreyImage> GreyFromPgm(std::string_view bytes);

/// Reads a PGM file. Needs no image library: those of OpenCV's imgcodecs would take 40 MB of a
/// daemon that hardly ever plays a recording.
Result<GreyImage> ReadPgm(const std::string& path);

}  // namespace plumbline
