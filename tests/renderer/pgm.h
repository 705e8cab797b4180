// PGM writer for rendered images.
#pragma once

#include <fstream>
#include <string>

#include "tests/renderer/scene.h"

namespace plumbline::renderer {

/// Writes the image as 8-bit binary PGM.
inline void WritePgm(const std::string& path, const Image& image) {
  std::ofstream(path, std::ios::binary) << "P5\n"
                                        << image.width << ' ' << image.height << "\n255\n"
                                        << std::string(image.grey.begin(), image.grey.end());
}

}  // namespace plumbline::renderer
