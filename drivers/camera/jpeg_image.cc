#include "drivers/camera/jpeg_image.h"

#include <fmt/format.h>

#include <csetjmp>
#include <cstddef>
#include <cstdio>
// These two need the ones above.
#include <jerror.h>
#include <jpeglib.h>

namespace plumbline::camera {
namespace {

/// State of libjpeg, which is C and reports errors by longjmp. Prints nothing.
struct Decoder {
  Decoder() {
    state.err = jpeg_std_error(&faults);
    faults.error_exit = [](j_common_ptr common) {
      auto* self = static_cast<Decoder*>(common->client_data);
      (*common->err->format_message)(common, self->message);
      std::longjmp(self->jump, 1);
    };
    faults.emit_message = [](j_common_ptr common, int level) {
      if (level >= 0) return;  // trace message
      auto* self = static_cast<Decoder*>(common->client_data);
      const int code = common->err->msg_code;
      if (code == JWRN_EXTRANEOUS_DATA || code == JWRN_ADOBE_XFORM) return;
      (*common->err->format_message)(common, self->message);
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
  char message[JMSG_LENGTH_MAX] = {};
};

/// Reads the header and checks it against the expected size and coding.
Result<void> ReadHeader(jpeg_decompress_struct& state, std::span<const std::uint8_t> bytes,
                        image::ImageSize size) {
  jpeg_mem_src(&state, bytes.data(), static_cast<unsigned long>(bytes.size()));
  if (jpeg_read_header(&state, TRUE) != JPEG_HEADER_OK) return Error{"a JPEG without an image"};
  if (state.image_width != static_cast<JDIMENSION>(size.width) ||
      state.image_height != static_cast<JDIMENSION>(size.height)) {
    return Error{fmt::format("a JPEG of {} x {} px instead of the negotiated {} x {}",
                             state.image_width, state.image_height, size.width, size.height)};
  }
  if (jpeg_has_multiple_scans(&state) != 0 || state.arith_code != 0) {
    return Error{"not a baseline JPEG (progressive, arithmetic or several scans)"};
  }
  return {};
}

/// Decodes all rows.
Result<void> ReadRows(Decoder& decoder, std::size_t row_bytes, std::uint8_t* pixels) {
  jpeg_start_decompress(&decoder.state);
  while (decoder.state.output_scanline < decoder.state.output_height && !decoder.damaged) {
    JSAMPROW row = pixels + row_bytes * decoder.state.output_scanline;
    jpeg_read_scanlines(&decoder.state, &row, 1);
  }
  if (!decoder.damaged) jpeg_finish_decompress(&decoder.state);
  if (decoder.damaged) return Error{fmt::format("a damaged JPEG: {}", decoder.message)};
  return {};
}

}  // namespace

Result<void> DecodeJpeg(std::span<const std::uint8_t> bytes, image::ImageSize size,
                        JpegColour colour, std::vector<std::uint8_t>& pixels) {
  if (bytes.empty()) return Error{"an empty frame"};
  if (size.width < 1 || size.height < 1) return Error{"an image without pixels"};
  const std::size_t channels = colour == JpegColour::kLuma ? 1 : 3;
  const std::size_t row_bytes = channels * static_cast<std::size_t>(size.width);
  pixels.resize(row_bytes * static_cast<std::size_t>(size.height));
  Decoder decoder;
  // No object with a destructor may be created from here on: longjmp would skip it.
  if (setjmp(decoder.jump) != 0) {
    return Error{fmt::format("a damaged JPEG: {}", decoder.message)};
  }
  jpeg_create_decompress(&decoder.state);
  if (auto header = ReadHeader(decoder.state, bytes, size); !header) return header;
  decoder.state.out_color_space = channels == 1 ? JCS_GRAYSCALE : JCS_EXT_BGR;
  return ReadRows(decoder, row_bytes, pixels.data());
}

Result<void> DecodeJpegFile(std::span<const std::uint8_t> bytes, GreyImage& image) {
  Decoder decoder;
  // As above: no object with a destructor from here on.
  if (setjmp(decoder.jump) != 0) {
    return Error{fmt::format("a damaged or unsupported JPEG: {}", decoder.message)};
  }
  jpeg_create_decompress(&decoder.state);
  jpeg_mem_src(&decoder.state, bytes.data(), static_cast<unsigned long>(bytes.size()));
  if (jpeg_read_header(&decoder.state, TRUE) != JPEG_HEADER_OK) {
    return Error{"a JPEG without an image"};
  }
  const std::size_t width = decoder.state.image_width, height = decoder.state.image_height;
  if (width * height > kMaxFilePixels) {
    return Error{fmt::format("a JPEG of {} x {} px; the limit is 100 megapixels", width, height)};
  }
  image.width = static_cast<int>(width);
  image.height = static_cast<int>(height);
  image.grey.resize(width * height);
  decoder.state.out_color_space = JCS_GRAYSCALE;
  return ReadRows(decoder, width, image.grey.data());
}

}  // namespace plumbline::camera
