// Reader for portable grey maps (PGM), the image format of recordings that the daemon replays.
#pragma once

#include <string>
#include <string_view>

#include "drivers/camera/image_folder.h"
#include "firmware-like/result.h"

namespace plumbline::camera {

/// Parses a binary 8-bit PGM: "P5", width, height and 255 as text with comments, one white space,
/// the pixels row by row. Trailing bytes are ignored. Pure.
Result<GreyImage> GreyFromPgm(std::string_view bytes);

/// Reads a PGM file. Needs no image library: OpenCV's imgcodecs would cost the daemon 40 MB
/// although it hardly ever replays a recording.
Result<GreyImage> ReadPgm(const std::string& path);

}  // namespace plumbline::camera
