// Any content in the blocks of a DV frame that is otherwise in order, and any bytes as a frame:
// what libdv makes of them stays in the picture.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "drivers/camera/dv_image.h"

using plumbline::DecodeDv;
using plumbline::ImageSize;

namespace {

constexpr std::size_t kBlock = 80, kHeader = 3, kSequence = 150;

/// `data` again and again in the blocks of `sequences` sequences, whose first bytes are right.
std::vector<std::uint8_t> FrameOf(const std::uint8_t* data, std::size_t size,
                                  std::size_t sequences) {
  std::vector<std::uint8_t> frame(sequences * kSequence * kBlock);
  std::size_t next = 0;
  for (std::size_t k = 0; k < frame.size(); ++k) frame[k] = data[next++ % size];
  for (std::size_t k = 0; k < sequences * kSequence; ++k) {
    const std::size_t place = k % kSequence;
    const unsigned section = place == 0              ? 0
                             : place < 3             ? 1
                             : place < 6             ? 2
                             : (place - 6) % 16 == 0 ? 3
                                                     : 4;
    std::uint8_t* const block = frame.data() + k * kBlock;
    block[0] = static_cast<std::uint8_t>(section << 5 | (block[0] & 0x1F));
    block[1] = static_cast<std::uint8_t>(k / kSequence << 4 | (block[1] & 0x0F));
    if (section == 4) block[kHeader] &= 0x0F;
  }
  frame[kHeader] =
      static_cast<std::uint8_t>((frame[kHeader] & 0x7F) | (sequences == 12 ? 0x80 : 0));
  return frame;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static std::vector<std::uint8_t> pixels;
  if (size < 2) return 0;
  const bool pal = (data[0] & 1) != 0;
  const ImageSize image{720, pal ? 576 : 480};
  std::vector<std::uint8_t> frame;
  if ((data[0] & 2) != 0) {
    frame.assign(data + 1, data + size);
  } else {
    frame = FrameOf(data + 1, size - 1, pal ? 12 : 10);
  }
  const auto why = DecodeDv(frame, image, pixels);
  if (why ? why->message.empty() : pixels.size() != std::size_t{1440} * (pal ? 576 : 480)) abort();
  return 0;
}
