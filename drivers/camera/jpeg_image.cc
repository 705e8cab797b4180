#include "drivers/camera/jpeg_image.h"

#include <fmt/format.h>

#include <csetjmp>
#include <cstddef>
#include <cstdio>
// These two need the ones above.
#include <jerror.h>
#include <jpeglib.h>

namespace plumbline {
namespace {

constexpr std::size_t kMostPixels = 100'000'000;  // of a file

/// libjpeg's state. Its faults come back by longjmp, since it is C; it prints nothing.
struct Decoder {
  Decoder() {
    state.err = jpeg_std_error(&faults);
    faults.error_exit = [](j_common_ptr common) {
      auto* self = static_cast<Decoder*>(common->client_data);
      (*common->err->format_message)(common, self->words);
      std::longjmp(self->jump, 1);
    };
    faults.emit_message = [](j_common_ptr common, int level) {
      if (level >= 0) return;  // a trace
      auto* self = static_cast<Decoder*>(common->client_data);
      const int code = common->err->msg_code;
      if (code == JWRN_EXTRANEOUS_DATA || code == JWRN_ADOBE_XFORM) return;
      (*common->err->format_message)(common, self->words);
      self->damaged = true;
    };
    faults.output_message = [](j_common_ptr) {};
    state.client_data = this;
  }
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;
  ~Decoder() { jpeg_destroy_decompress(&state); }

  jpeg_decompress_struct state{};
  jpeg_error_mgr faults{};
  std::jmp_buf jump{};
  bool damaged = false;
  char words[JMSG_LENGTH_MAX] = {};
};

/// Reads the header and what it says against what is wanted. @return why not
Result<void> Begin(jpeg_decompress_struct& state, std::span<const std::uint8_t> bytes,
                   ImageSize size) {
  jpeg_mem_src(&state, bytes.data(), static_cast<unsigned long>(bytes.size()));
  if (jpeg_read_header(&state, TRUE) != JPEG_HEADER_OK) return Error{"a JPEG without an image"};
  if (state.image_width != static_cast<JDIMENSION>(size.width) ||
      state.image_height != static_cast<JDIMENSION>(size.height)) {
    return Error{fmt::format("a JPEG of {} x {} px where {} x {} were agreed", state.image_width,
                             state.image_height, size.width, size.height)};
  }
  if (jpeg_has_multiple_scans(&state) != 0 || state.arith_code != 0) {
    return Error{"a JPEG that is not of the baseline kind (progressive, or several scans)"};
  }
  return {};
}

/// Decodes all rows. @return why they are of no use
Result<void> ReadRows(Decoder& decoder, std::size_t row_bytes, std::uint8_t* pixels) {
  jpeg_start_decompress(&decoder.state);
  while (decoder.state.output_scanline < decoder.state.output_height && !decoder.damaged) {
    JSAMPROW row = pixels + row_bytes * decoder.state.output_scanline;
    jpeg_read_scanlines(&decoder.state, &row, 1);
  }
  if (!decoder.damaged) jpeg_finish_decompress(&decoder.state);
  if (decoder.damaged) return Error{fmt::format("a damaged JPEG: {}", decoder.words)};
  return {};
}

}  // namespace

Result<void> DecodeJpeg(std::span<const std::uint8_t> bytes, ImageSize size, JpegColour colour,
                        std::vector<std::uint8_t>& pixels) {
  if (bytes.empty()) return Error{"an empty frame"};
  if (size.width < 1 || size.height < 1) return Error{"an image without pixels is not possible"};
  const std::size_t channels = colour == JpegColour::kLuma ? 1 : 3;
  const std::size_t row_bytes = channels * static_cast<std::size_t>(size.width);
  pixels.resize(row_bytes * static_cast<std::size_t>(size.height));
  Decoder decoder;
  // Nothing with a destructor may begin between here and the end: a fault jumps over it.
  if (setjmp(decoder.jump) != 0) {
    return Error{fmt::format("a damaged JPEG: {}", decoder.words)};
  }
  jpeg_create_decompress(&decoder.state);
  if (auto begun = Begin(decoder.state, bytes, size); !begun) return begun;
  decoder.state.out_color_space = channels == 1 ? JCS_GRAYSCALE : JCS_EXT_BGR;
  return ReadRows(decoder, row_bytes, pixels.data());
}

Result<void> DecodeJpegFile(std::span<const std::uint8_t> bytes, GreyImage& image) {
  Decoder decoder;
  // As above: nothing with a destructor may begin from here on.
  if (setjmp(decoder.jump) != 0) {
    return Error{fmt::format("a damaged JPEG, or an unknown kind of it: {}", decoder.words)};
  }
  jpeg_create_decompress(&decoder.state);
  jpeg_mem_src(&decoder.state, bytes.data(), static_cast<unsigned long>(bytes.size()));
  if (jpeg_read_header(&decoder.state, TRUE) != JPEG_HEADER_OK) {
    return Error{"a JPEG without an image"};
  }
  const std::size_t width = decoder.state.image_width, height = decoder.state.image_height;
  if (width * height > kMostPixels) {
    return Error{fmt::format("a JPEG of {} x {} px; 100 megapixels are the most", width, height)};
  }
  image.width = static_cast<int>(width);
  image.height = static_cast<int>(height);
  image.grey.resize(width * height);
  decoder.state.out_color_space = JCS_GRAYSCALE;
  return ReadRows(decoder, width, image.grey.data());
}

}  // namespace plumbline
