#include "drivers/camera/dif_frame.h"

#include <fmt/format.h>

namespace plumbline::camera {
namespace {

constexpr std::size_t kBlocksPerSequence = 150;
constexpr unsigned kHeader = 0, kSubcode = 1, kAuxiliary = 2, kAudio = 3, kVideo = 4;

/// Identification of a block: section type, and its number among those of the section.
struct DifBlock {
  unsigned section, number;
};

/// @param index  of the block in its sequence, 0..149
constexpr DifBlock ExpectedBlock(unsigned index) {
  if (index == 0) return {kHeader, 0};
  if (index < 3) return {kSubcode, index - 1};
  if (index < 6) return {kAuxiliary, index - 3};
  const unsigned group = (index - 6) / 16, place = (index - 6) % 16;
  if (place == 0) return {kAudio, group};
  return {kVideo, 15 * group + place - 1};
}

/// Section type in bits 7..5 of byte 0; sequence in bits 7..4 of byte 1, whose bit 3 is set in the
/// second half of a 50 Mbit/s frame; number in byte 2.
bool IsBlock(std::span<const std::uint8_t> block, unsigned sequence, unsigned index) {
  const DifBlock expected = ExpectedBlock(index);
  return block[0] >> 5 == expected.section && (block[1] & 0xF8U) == sequence << 4 &&
         block[2] == expected.number;
}

/// The video source control pack, in the last auxiliary block of the first sequence, states the
/// aspect ratio. [IEC 61834-4, pack 61h]
bool IsWide(std::span<const std::uint8_t> frame) {
  constexpr std::size_t kPack = 5 * kDifBlockBytes + 3 + 10 * 5;
  constexpr unsigned kVideoControl = 0x61;
  if (frame[kPack] != kVideoControl) return false;
  const unsigned display = frame[kPack + 2] & 7U, application = frame[4] & 7U;
  return display == 2 || (application == 0 && display == 7);
}

}  // namespace

std::size_t DifFrameBytes(bool lines_625) {
  return (lines_625 ? 12 : 10) * kBlocksPerSequence * kDifBlockBytes;
}

int FieldRows(const DifFormat& format) {
  return format.lines_625 ? 288 : 240;
}

double FrameRate(const DifFormat& format) {
  return format.lines_625 ? 25 : 30000.0 / 1001;
}

image::ImageSize SquareSize(const DifFormat& format) {
  if (format.lines_625) return {format.wide ? 1049 : 787, 576};
  return {format.wide ? 873 : 655, 480};
}

std::optional<std::size_t> DifFrameBytesOfHeader(std::span<const std::uint8_t> block) {
  if (block.size() < kDifBlockBytes || !IsBlock(block, 0, 0)) return std::nullopt;
  return DifFrameBytes((block[3] & 0x80U) != 0);
}

std::optional<std::size_t> DifFrameBytesOfStart(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < kDifStartBytes) return std::nullopt;
  for (unsigned i = 0; i * kDifBlockBytes < kDifStartBytes; ++i) {
    if (!IsBlock(bytes.subspan(i * kDifBlockBytes, kDifBlockBytes), 0, i)) return std::nullopt;
  }
  return DifFrameBytesOfHeader(bytes);
}

Result<DifFormat> CheckDifFrame(std::span<const std::uint8_t> bytes) {
  const auto size = DifFrameBytesOfHeader(bytes);
  if (!size) return Error{"not a DV frame: it does not start with a header block"};
  if (bytes.size() != *size) {
    return Error{fmt::format("a DV frame of {} bytes instead of {}", bytes.size(), *size)};
  }
  const auto blocks = static_cast<unsigned>(*size / kDifBlockBytes);
  for (unsigned i = 0; i < blocks; ++i) {
    const auto block = bytes.subspan(i * kDifBlockBytes, kDifBlockBytes);
    const auto sequence = static_cast<unsigned>(i / kBlocksPerSequence);
    const auto index = static_cast<unsigned>(i % kBlocksPerSequence);
    if (!IsBlock(block, sequence, index)) {
      return Error{
          fmt::format("a damaged DV frame: block {} of sequence {} is identified as "
                      "{:02x} {:02x} {:02x}",
                      index, sequence, block[0], block[1], block[2])};
    }
    const unsigned state = block[3] >> 4;
    if (ExpectedBlock(index).section == kVideo && state != 0) {
      return Error{
          fmt::format("a DV frame whose camera marked block {} of sequence {} as damaged "
                      "or concealed (STA {:x})",
                      index, sequence, state)};
    }
  }
  return DifFormat{(bytes[3] & 0x80U) != 0, IsWide(bytes)};
}

}  // namespace plumbline::camera
