#include "app/display/view_process/png_file.h"

#include <fmt/format.h>
#include <png.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "drivers/files/open_failure.h"
#include "drivers/files/replace_file.h"
#include "drivers/files/text_file.h"

namespace plumbline::display {

Result<std::string> PngOf(const display::RgbImage& picture, bool fast) {
  const auto width = static_cast<std::size_t>(picture.size.width);
  const auto height = static_cast<std::size_t>(picture.size.height);
  if (width == 0 || height == 0 || picture.rgb.size() != 3 * width * height) {
    return Error{"the picture is empty"};
  }
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = PNG_FORMAT_RGB;
  image.flags = fast ? PNG_IMAGE_FLAG_FAST : 0;
  char* memory = nullptr;
  std::size_t size = 0;
  std::FILE* const out = open_memstream(&memory, &size);
  if (out == nullptr) return Error{std::strerror(errno)};
  const bool encoded =
      png_image_write_to_stdio(&image, out, 0, picture.rgb.data(), 0, nullptr) != 0;
  const bool whole = std::fclose(out) == 0 && encoded;
  std::string bytes = whole ? std::string(memory, size) : "";
  std::free(memory);
  if (!whole) return Error{encoded ? "not enough memory to encode the picture" : image.message};
  return bytes;
}

Result<void> WritePng(const std::string& file, const display::RgbImage& picture) {
  const Result<std::string> bytes = PngOf(picture);
  if (!bytes) return Error{fmt::format("{}: {}", file, bytes.error())};
  return files::WriteTextFile(file, *bytes).transform_error([&file](const std::string& why) {
    return fmt::format("{}: {}", file, why);
  });
}

Result<void> WritePngBytes(const std::string& file, std::string_view bytes) {
  return files::ReplaceFile(file, bytes).transform_error([&file](const std::string& why) {
    return fmt::format("{}: {}", file, files::WriteErrorText(file, why));
  });
}

}  // namespace plumbline::display
