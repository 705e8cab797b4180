// Fuzzer: arbitrary bytes as a camera frame: format, width, height and stride, then the data. Every
// pixel of the result lies in the frame or in the buffer, and luma and colour accept the same
// frames.
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "drivers/camera/pixel_format.h"

namespace {

using namespace plumbline;  // NOLINT(google-build-using-namespace)

constexpr std::size_t kHeader = 7;
constexpr int kSide = 0x1FF;  // larger images are slower without new cases

void Require(bool condition) {
  if (!condition) std::abort();
}

int Number(const std::uint8_t* data) {
  return data[0] + 256 * data[1];
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static std::vector<std::uint8_t> luma, bgr;
  if (size < kHeader) return 0;
  camera::RawImage image;
  image.format = static_cast<camera::PixelFormat>(data[0] % camera::kPixelFormats);
  image.size = {Number(data + 1) & kSide, Number(data + 3) & kSide};
  image.stride = Number(data + 5) - 256;
  image.bytes = {data + kHeader, size - kHeader};
  const auto view = camera::LumaOf(image, luma);
  if (view) {
    Require(view->size() == image.size && view->stride >= view->width);
    unsigned all = 0;
    for (int v = 0; v < view->height; ++v) {
      for (int x = 0; x < view->width; ++x) all += view->row(v)[x];
    }
    Require(all <= 255U * static_cast<unsigned>(view->width * view->height));
  } else {
    Require(!view.error().empty());
  }
  const bool converted = camera::BgrOf(image, bgr).ok();
  // A JPEG may be damaged only in its chroma, or have a colour space without luma.
  if (image.format != camera::PixelFormat::kMjpeg) Require(view.ok() == converted);
  if (converted) {
    const auto pixels =
        static_cast<std::size_t>(image.size.width) * static_cast<std::size_t>(image.size.height);
    Require(bgr.size() == 3 * pixels);
  }
  return 0;
}
