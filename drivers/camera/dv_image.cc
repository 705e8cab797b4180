#include "drivers/camera/dv_image.h"

#include <fmt/format.h>
#include <libdv/dv.h>

#include <array>
#include <cstddef>
#include <memory>
#include <mutex>

namespace plumbline {
namespace {

constexpr int kWidth = 720, kRowBytes = 2 * kWidth;
constexpr std::size_t kBlock = 80, kBlocksInSequence = 150;

/// Section types of a sequence's blocks (SMPTE 314M, 2.3.2): a header, two of subcode, three of
/// auxiliary video data, then nine times one of audio and fifteen of video.
unsigned SectionOf(std::size_t block) {
  constexpr unsigned kHeader = 0, kSubcode = 1, kAuxiliary = 2, kAudio = 3, kVideo = 4;
  if (block == 0) return kHeader;
  if (block < 3) return kSubcode;
  if (block < 6) return kAuxiliary;
  return (block - 6) % 16 == 0 ? kAudio : kVideo;
}

/// Why these blocks are no frame of so many sequences. What is checked here libdv takes for
/// granted.
std::optional<Error> BlockFault(std::span<const std::uint8_t> bytes, std::size_t sequences) {
  for (std::size_t k = 0; k < sequences * kBlocksInSequence; ++k) {
    const std::uint8_t* const block = bytes.data() + k * kBlock;
    const unsigned section = block[0] >> 5, sequence = block[1] >> 4;
    if (section != SectionOf(k % kBlocksInSequence) || sequence != k / kBlocksInSequence) {
      return Error{fmt::format("no DV frame: block {} is not what belongs there", k)};
    }
    constexpr unsigned kVideo = 4;
    const unsigned damage = block[3] >> 4;  // STA of a video block, 0: sound
    if (section == kVideo && damage != 0) {
      return Error{fmt::format("a damaged DV frame: the camera marked block {}", k)};
    }
  }
  const bool lines_625 = (bytes[3] & 0x80) != 0;
  if (lines_625 != (sequences == 12)) return Error{"no DV frame: its size and its header differ"};
  return std::nullopt;
}

struct FreeDecoder {
  void operator()(dv_decoder_t* decoder) const { dv_decoder_free(decoder); }
};

/// libdv's tables are the process's; a decoder is its thread's.
dv_decoder_t& DvDecoder() {
  static std::mutex making;
  thread_local std::unique_ptr<dv_decoder_t, FreeDecoder> decoder;
  if (!decoder) {
    const std::lock_guard lock(making);
    decoder.reset(dv_decoder_new(0, 0, 0));
    decoder->quality = DV_QUALITY_BEST;
    dv_set_error_log(decoder.get(), nullptr);
  }
  return *decoder;
}

/// The lines of the other field, from those of the first.
void FillOtherField(std::vector<std::uint8_t>& yuyv, int height) {
  for (int v = 1; v < height; v += 2) {
    std::uint8_t* const row = yuyv.data() + static_cast<std::ptrdiff_t>(v) * kRowBytes;
    const std::uint8_t* const above = row - kRowBytes;
    const std::uint8_t* const below = v + 1 < height ? row + kRowBytes : above;
    for (int x = 0; x < kRowBytes; ++x) {
      row[x] = static_cast<std::uint8_t>((above[x] + below[x] + 1) / 2);
    }
  }
}

}  // namespace

std::optional<Error> DecodeDv(std::span<const std::uint8_t> bytes, ImageSize size,
                              std::vector<std::uint8_t>& yuyv) {
  const bool lines_625 = size == ImageSize{kWidth, 576};
  if (!lines_625 && size != ImageSize{kWidth, 480}) {
    return Error{fmt::format("DV of {} x {} px is not possible", size.width, size.height)};
  }
  const std::size_t sequences = lines_625 ? 12 : 10;
  const std::size_t needed = sequences * kBlocksInSequence * kBlock;
  if (bytes.size() < needed) {
    return Error{fmt::format("a short frame: {} bytes where {} x {} px DV have {}", bytes.size(),
                             size.width, size.height, needed)};
  }
  if (const auto why = BlockFault(bytes, sequences)) return why;
  dv_decoder_t& decoder = DvDecoder();
  if (dv_parse_header(&decoder, bytes.data()) < 0 || decoder.width != size.width ||
      decoder.height != size.height) {
    return Error{"no DV frame of 25 Mbit/s"};
  }
  yuyv.resize(static_cast<std::size_t>(kRowBytes) * static_cast<std::size_t>(size.height));
  std::array<std::uint8_t*, 3> pixels = {yuyv.data(), nullptr, nullptr};
  std::array<int, 3> pitches = {kRowBytes, 0, 0};
  dv_decode_full_frame(&decoder, bytes.data(), e_dv_color_yuv, pixels.data(), pitches.data());
  FillOtherField(yuyv, size.height);
  return std::nullopt;
}

}  // namespace plumbline
