#include "drivers/camera/dif_stream.h"

#include <algorithm>

namespace plumbline::camera {
namespace {

/// Offset of the first byte that starts a frame. If there is none, of the first byte that cannot be
/// judged yet.
/// @param from  first offset
std::size_t FindFrame(std::span<const std::uint8_t> bytes, std::size_t from) {
  std::size_t at = from;
  while (at + kDifStartBytes <= bytes.size() && !DifFrameBytesOfStart(bytes.subspan(at))) ++at;
  return at;
}

}  // namespace

void DifStream::Append(std::span<const std::uint8_t> piece) {
  bytes_.insert(bytes_.end(), piece.begin(), piece.end());
}

int DifStream::TakeNewest(std::vector<std::uint8_t>& frame) {
  const std::span<const std::uint8_t> bytes(bytes_);
  int complete = 0;
  std::size_t of_frames = 0;
  std::size_t at = FindFrame(bytes, 0);
  for (;;) {
    const auto size = DifFrameBytesOfStart(bytes.subspan(std::min(at, bytes.size())));
    if (!size || bytes.size() - at < *size) break;
    const auto candidate = bytes.subspan(at, *size);
    if (const auto checked = CheckDifFrame(candidate)) {
      frame.assign(candidate.begin(), candidate.end());
      ++complete;
      of_frames += *size;
      at = FindFrame(bytes, at + *size);
    } else {
      ++damaged_;
      why_damaged_ = checked.error();
      at = FindFrame(bytes, at + kDifBlockBytes);
    }
  }
  const std::size_t done = std::min(at, bytes_.size());
  skipped_ += done - of_frames;
  bytes_.erase(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(done));
  return complete;
}

}  // namespace plumbline::camera
