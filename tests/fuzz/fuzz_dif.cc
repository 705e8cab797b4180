// Fuzzer: DV data. The first byte selects: a valid frame with bytes changed (offset in three bytes,
// value) or cut; a stream of arbitrary pieces between frames; the header of plumbline-dv's answer.
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <span>
#include <vector>

#include "drivers/camera/dif_frame.h"
#include "drivers/camera/dif_stream.h"
#include "drivers/camera/dv_field.h"

namespace {

using namespace plumbline;  // NOLINT(google-build-using-namespace)
using Bytes = std::vector<std::uint8_t>;

void Require(bool condition) {
  if (!condition) std::abort();
}

/// Section type and number of each block of a sequence, listed in the order of the standard.
std::vector<std::array<int, 2>> Blocks() {
  std::vector<std::array<int, 2>> blocks = {{0, 0}, {1, 0}, {1, 1}, {2, 0}, {2, 1}, {2, 2}};
  for (int group = 0; group < 9; ++group) {
    blocks.push_back({3, group});
    for (int n = 0; n < 15; ++n) blocks.push_back({4, 15 * group + n});
  }
  return blocks;
}

Bytes GoodFrame(int sequences) {
  static const auto blocks = Blocks();
  Bytes frame;
  for (int s = 0; s < sequences; ++s) {
    for (const auto& [section, number] : blocks) {
      const std::array<int, 4> start = {section << 5 | 0x1F, s << 4 | 7, number,
                                        section == 0 && sequences == 12 ? 0x80 : 0};
      for (const int byte : start) frame.push_back(static_cast<std::uint8_t>(byte));
      frame.insert(frame.end(), 76, 0);
    }
  }
  return frame;
}

/// An accepted frame differs from a good one only where nothing identifies or marks a block.
void RequireValid(const Bytes& frame) {
  static const Bytes pal = GoodFrame(12), ntsc = GoodFrame(10);
  const auto format = camera::CheckDifFrame(frame);
  if (!format) {
    Require(!format.error().empty());
    return;
  }
  const Bytes& good = format->lines_625 ? pal : ntsc;
  Require(frame.size() == good.size() && frame.size() == camera::DifFrameBytes(format->lines_625));
  for (std::size_t at = 0; at < good.size(); at += 80) {
    Require(frame[at] >> 5 == good[at] >> 5 && frame[at + 1] >> 3 == good[at + 1] >> 3);
    Require(frame[at + 2] == good[at + 2] && (good[at] >> 5 != 4 || frame[at + 3] >> 4 == 0));
  }
}

void ChangeFrame(std::span<const std::uint8_t> data) {
  static const Bytes good = GoodFrame(12);
  static Bytes frame;
  frame = good;
  for (; data.size() >= 4; data = data.subspan(4)) {
    const std::size_t offset = data[0] + 256U * data[1] + 65536U * data[2];
    if (offset < frame.size()) {
      frame[offset] = data[3];
    } else {
      frame.resize(frame.size() - std::min<std::size_t>(frame.size(), data[3]));
    }
  }
  RequireValid(frame);
}

/// Every valid frame of the stream is found unless the pieces around it contain the start of one.
void FollowStream(std::span<const std::uint8_t> data) {
  static const Bytes good = GoodFrame(10);
  camera::DifStream stream;
  Bytes frame;
  int found = 0;
  for (int k = 0; k < 2; ++k) {
    const auto piece = data.first(data.size() / 2);
    stream.Append(k == 0 ? piece : data.subspan(piece.size()));
    found += stream.TakeNewest(frame);
    stream.Append(good);
    found += stream.TakeNewest(frame);
    if (!frame.empty()) RequireValid(frame);
  }
  Require(found <= 2);
  if (stream.damaged() == 0 && data.size() < camera::kDifStartBytes) Require(found == 2);
}

void ReadAnswer(std::span<const std::uint8_t> data) {
  std::array<std::uint8_t, sizeof(camera::DvAnswerHeader)> header{};
  std::memcpy(header.data(), data.data(), std::min(data.size(), header.size()));
  for (const bool lines_625 : {false, true}) {
    const camera::DifFormat format{.lines_625 = lines_625};
    const auto bytes = camera::DvAnswerBytes(header, format);
    Require(!bytes || *bytes == 0 || *bytes == (lines_625 ? 414720 : 345600));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::span<const std::uint8_t> rest(data + 1, size - 1);
  switch (data[0] % 3) {
    case 0:
      ChangeFrame(rest);
      break;
    case 1:
      FollowStream(rest);
      break;
    default:
      ReadAnswer(rest);
  }
  return 0;
}
