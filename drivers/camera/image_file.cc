#include "drivers/camera/image_file.h"

#include <atomic>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "drivers/camera/image_codecs.h"
#include "drivers/camera/jpeg_image.h"
#include "drivers/files/open_failure.h"
#include "drivers/files/package_paths.h"

namespace plumbline::camera {

namespace fs = std::filesystem;
namespace {

/// Not with OpenCV, which lets libjpeg print errors and fills the damaged part with grey.
Result<GreyImage> ReadJpeg(std::istream& file) {
  const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(file), {}};
  GreyImage image;
  if (auto decoded = DecodeJpegFile(bytes, image); !decoded) return decoded.failure();
  return image;
}

bool HasJpegSignature(std::istream& file) {
  const bool is_jpeg = file.get() == 0xFF && file.get() == 0xD8;
  file.clear();
  file.seekg(0);
  return is_jpeg;
}

/// The codec module, loaded by the first caller, or why it cannot be loaded.
const Result<ImageCodecs>& InstalledCodecs() {
  static const Result<ImageCodecs> codecs = OpenImageCodecs(files::SiblingModule(kImageCodecsFile));
  return codecs;
}

/// True once an image was rejected because the module cannot be loaded.
std::atomic<bool> codecs_were_needed{false};

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
  if (why) return Error{files::ReadErrorText(path, why.message())};
  if (bytes > std::uintmax_t{256} << 20) return Error{"larger than 256 MB"};
  std::ifstream file(path, std::ios::binary);
  if (HasJpegSignature(file)) return ReadJpeg(file);
  const Result<ImageCodecs>& codecs = InstalledCodecs();
  if (!codecs) {
    codecs_were_needed = true;
    return codecs.failure();
  }
  GreyImage image;
  if (const char* fault = codecs->read_grey(path.c_str(), Take, &image)) return Error{fault};
  return image;
}

Result<void> CheckImageCodecs() {
  if (!codecs_were_needed || InstalledCodecs()) return {};
  return InstalledCodecs().failure();
}

}  // namespace plumbline::camera
