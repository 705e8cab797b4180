#include "app/display/page/picture_feed.h"

#include <csetjmp>
#include <cstdio>
#include <cstdlib>
// jpeglib.h needs the headers above.
#include <jpeglib.h>

namespace plumbline::display {
namespace {

constexpr int kQuality = 80;

/// libjpeg's state. Errors return by longjmp; messages are suppressed.
struct Encoder {
  Encoder() {
    state.err = jpeg_std_error(&faults);
    faults.error_exit = [](j_common_ptr common) {
      std::longjmp(static_cast<Encoder*>(common->client_data)->jump, 1);
    };
    faults.output_message = [](j_common_ptr) {};
    state.client_data = this;
  }
  Encoder(const Encoder&) = delete;
  Encoder& operator=(const Encoder&) = delete;
  ~Encoder() {
    jpeg_destroy_compress(&state);
    std::free(bytes);
  }

  jpeg_compress_struct state{};
  jpeg_error_mgr faults{};
  std::jmp_buf jump{};
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
};

/// Must not create objects with destructors: errors leave by longjmp.
bool Encode(const display::RgbImage& image, Encoder& encoder) {
  if (setjmp(encoder.jump) != 0) return false;
  jpeg_create_compress(&encoder.state);
  jpeg_mem_dest(&encoder.state, &encoder.bytes, &encoder.size);
  encoder.state.image_width = static_cast<JDIMENSION>(image.size.width);
  encoder.state.image_height = static_cast<JDIMENSION>(image.size.height);
  encoder.state.input_components = 3;
  encoder.state.in_color_space = JCS_RGB;
  jpeg_set_defaults(&encoder.state);
  jpeg_set_quality(&encoder.state, kQuality, TRUE);
  jpeg_start_compress(&encoder.state, TRUE);
  const std::size_t row_bytes = static_cast<std::size_t>(image.size.width) * 3;
  while (encoder.state.next_scanline < encoder.state.image_height) {
    JSAMPROW row = const_cast<JSAMPROW>(image.rgb.data() + row_bytes * encoder.state.next_scanline);
    jpeg_write_scanlines(&encoder.state, &row, 1);
  }
  jpeg_finish_compress(&encoder.state);
  return true;
}

}  // namespace

std::string JpegOf(const display::RgbImage& image) {
  const auto pixels =
      static_cast<std::size_t>(image.size.width) * static_cast<std::size_t>(image.size.height);
  if (pixels == 0 || image.rgb.size() != 3 * pixels) return "";
  Encoder encoder;
  if (!Encode(image, encoder)) return "";
  return {reinterpret_cast<const char*>(encoder.bytes), encoder.size};
}

std::shared_ptr<const JpegPicture> PictureFeed::Newest(double now_s) {
  const std::shared_ptr<const display::DisplayPicture> picture = shown_.RequestPicture(now_s);
  const std::lock_guard lock(mutex_);
  if (!picture || picture == encoded_) return newest_;
  if (now_s - encoded_s_ < 0.9 * kPeriod_s) return newest_;
  std::string bytes = JpegOf(picture->image);
  if (bytes.empty()) return newest_;
  const std::uint64_t number = newest_ ? newest_->number + 1 : 1;
  newest_ = std::make_shared<const JpegPicture>(JpegPicture{std::move(bytes), number});
  encoded_ = picture;
  encoded_s_ = now_s;
  return newest_;
}

}  // namespace plumbline::display
