// Pictures as PNG files.
#pragma once

#include <optional>
#include <string>

#include "drivers/display/picture.h"
#include "firmware-like/result.h"

namespace plumbline {

/// Written beside the name and renamed: the name never stands for half a picture.
/// @param fast  larger by a half, written in a third of the time
std::optional<Error> WritePng(const std::string& file, const RgbImage& picture, bool fast = false);

}  // namespace plumbline
