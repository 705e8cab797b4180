// Pictures as PNG files.
#pragma once

#include <string>
#include <string_view>

#include "drivers/display/picture.h"
#include "firmware-like/result.h"

namespace plumbline {

/// As bytes of a PNG file. @param fast  larger by a half, made in a third of the time
Result<std::string> PngOf(const RgbImage& picture, bool fast = false);

/// Written beside the name and renamed: the name never stands for half a picture.
Result<void> WritePng(const std::string& file, const RgbImage& picture);
/// Bytes that are a PNG already, into a state directory: no link is followed.
Result<void> KeepPngBytes(const std::string& file, std::string_view bytes);

}  // namespace plumbline
