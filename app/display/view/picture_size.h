// Picture size parser for command-line options such as "1280x720".
#pragma once

#include <charconv>
#include <optional>
#include <string>
#include <string_view>

#include "firmware-like/image/image_size.h"
#include "firmware-like/lens/lens.h"

namespace plumbline::display {

/// @return  nullopt if malformed or outside the sizes that the layout supports
inline std::optional<image::ImageSize> PictureSizeFrom(std::string_view text) {
  image::ImageSize size;
  const char* const end = text.data() + text.size();
  const auto width = std::from_chars(text.data(), end, size.width);
  if (width.ec != std::errc() || width.ptr == end || *width.ptr != 'x') return std::nullopt;
  const auto height = std::from_chars(width.ptr + 1, end, size.height);
  if (height.ec != std::errc() || height.ptr != end) return std::nullopt;
  if (size.width < 640 || size.width > 3840 || size.height < 480 || size.height > 2160) {
    return std::nullopt;
  }
  return size;
}

inline std::string PictureSizeProblem(const std::string& text) {
  return text + " is not a size between 640x480 and 3840x2160";
}

}  // namespace plumbline::display
