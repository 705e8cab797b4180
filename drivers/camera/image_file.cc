#include "drivers/camera/image_file.h"

#include <atomic>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "drivers/camera/image_codecs.h"
#include "drivers/camera/jpeg_image.h"
#include "drivers/files/open_failure.h"
#include "drivers/files/package_paths.h"

namespace plumbline {

namespace fs = std::filesystem;
namespace {

/// OpenCV lets libjpeg print what is wrong with a file, and paints the rest grey.
Result<GreyImage> ReadJpeg(std::istream& file) {
  const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(file), {}};
  GreyImage image;
  if (auto decoded = DecodeJpegFile(bytes, image); !decoded) return decoded.failure();
  return image;
}

bool BeginsAsJpeg(std::istream& file) {
  const bool begins = file.get() == 0xFF && file.get() == 0xD8;
  file.clear();
  file.seekg(0);
  return begins;
}

/// The module, opened by the first caller; or why it cannot be.
const Result<ImageCodecs>& InstalledCodecs() {
  static const Result<ImageCodecs> codecs = OpenImageCodecs(ModuleBeside(kImageCodecsFile));
  return codecs;
}

/// An image was refused because the module cannot be opened.
std::atomic<bool> codecs_missed{false};

void Take(void* image, int width, int height, const std::uint8_t* grey) {
  auto& taken = *static_cast<GreyImage*>(image);
  taken.width = width;
  taken.height = height;
  taken.grey.assign(grey, grey + std::ptrdiff_t{width} * height);
}

}  // namespace

Result<GreyImage> ReadImage(const std::string& path) {
  std::error_code why;
  const std::uintmax_t bytes = fs::file_size(path, why);
  if (why) return Error{CannotBeRead(path, why.message())};
  if (bytes > std::uintmax_t{256} << 20) return Error{"larger than 256 MB"};
  std::ifstream file(path, std::ios::binary);
  if (BeginsAsJpeg(file)) return ReadJpeg(file);
  const Result<ImageCodecs>& codecs = InstalledCodecs();
  if (!codecs) {
    codecs_missed = true;
    return codecs.failure();
  }
  GreyImage image;
  if (const char* fault = codecs->read_grey(path.c_str(), Take, &image)) return Error{fault};
  return image;
}

std::optional<Error> MissingImageCodecs() {
  if (!codecs_missed) return std::nullopt;
  return InstalledCodecs().failure();
}

}  // namespace plumbline
