// Frames in a continuous stream of DV data. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "drivers/camera/dif_frame.h"

namespace plumbline::camera {

/// Finds whole frames in a stream that may start, and lose data, anywhere. Where the data are no
/// valid frame, the search continues within them, so that lost data cost only the frames they are
/// missing from.
class DifStream {
 public:
  /// @param piece  the next bytes; keep it below a frame, so that TakeNewest() sees every frame
  void Append(std::span<const std::uint8_t> piece);

  /// Takes the last whole frame; earlier ones are dropped.
  /// @param frame  receives a frame that CheckDifFrame() accepts; unchanged if there is none
  /// @return       number of frames that were complete, including those dropped
  int TakeNewest(std::vector<std::uint8_t>& frame);

  /// Frames that were not valid, so far.
  std::uint64_t damaged() const { return damaged_; }
  /// Bytes outside valid frames, so far.
  std::uint64_t skipped() const { return skipped_; }
  /// Why the last of the damaged frames was not valid.
  const std::string& why_damaged() const { return why_damaged_; }

 private:
  std::vector<std::uint8_t> bytes_;  ///< at most two frames
  std::uint64_t damaged_ = 0, skipped_ = 0;
  std::string why_damaged_;
};

}  // namespace plumbline::camera
