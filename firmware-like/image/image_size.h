// Size of an image in pixels.
#pragma once

namespace plumbline::image {

struct ImageSize {
  int width = 0;   ///< [px]
  int height = 0;  ///< [px]
  bool operator==(const ImageSize&) const = default;
};

}  // namespace plumbline::image
