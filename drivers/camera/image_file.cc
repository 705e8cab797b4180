#include "drivers/camera/image_file.h"

#include <fmt/format.h>

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

std::optional<PngSize> SizeFromPngHeader(std::string_view bytes) {
  constexpr std::string_view kSignature = "\x89PNG\r\n\x1A\n", kHeader = "IHDR";
  constexpr std::size_t kHeaderAt = 12, kWidthAt = 16, kHeightAt = 20;
  if (bytes.size() < kPngHeaderBytes || !bytes.starts_with(kSignature) ||
      bytes.substr(kHeaderAt, kHeader.size()) != kHeader) {
    return std::nullopt;
  }
  const auto number = [bytes](std::size_t at) {
    std::uint32_t value = 0;
    for (const char byte : bytes.substr(at, 4))
      value = value << 8 | static_cast<std::uint8_t>(byte);
    return value;
  };
  return PngSize{number(kWidthAt), number(kHeightAt)};
}

Result<GreyImage> ReadImage(const std::string& path) {
  std::error_code why;
  const std::uintmax_t bytes = fs::file_size(path, why);
  if (why) return Error{files::ReadErrorText(path, why.message())};
  if (bytes > std::uintmax_t{256} << 20) return Error{"larger than 256 MB"};
  std::ifstream file(path, std::ios::binary);
  if (HasJpegSignature(file)) return ReadJpeg(file);
  std::string header(kPngHeaderBytes, '\0');
  file.read(header.data(), static_cast<std::streamsize>(header.size()));
  if (const auto size = SizeFromPngHeader(header);
      size && std::uint64_t{size->width} * size->height > kMaxFilePixels) {
    return Error{
        fmt::format("a PNG of {} x {} px; the limit is 100 megapixels", size->width, size->height)};
  }
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
