// PNG encoder and file writer.
#pragma once

#include <string>
#include <string_view>

#include "drivers/display/picture.h"
#include "firmware-like/result.h"

namespace plumbline::display {

/// Encodes a picture.
/// @param fast  a third of the time for files that are 1.5 times as large
Result<std::string> PngOf(const display::RgbImage& picture, bool fast = false);

/// Writes atomically, by renaming a temporary file.
Result<void> WritePng(const std::string& file, const display::RgbImage& picture);
/// Writes encoded bytes to a file of the state directory; follows no symbolic link.
Result<void> WritePngBytes(const std::string& file, std::string_view bytes);

}  // namespace plumbline::display
