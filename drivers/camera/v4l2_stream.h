// Frames from an open device through buffers that it shares with us.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "firmware-like/result.h"

namespace plumbline {

/// A frame in a shared buffer.
struct V4l2Frame {
  std::span<const std::uint8_t> bytes;
  std::uint32_t sequence = 0;
  std::optional<double> time_s;  ///< CLOCK_MONOTONIC; nothing where the driver has another clock
};

enum class V4l2Answer : std::uint8_t {
  kFrame,
  kNothing,  ///< none is ready
  kDamaged,  ///< only such as the driver itself calls damaged
  kGone,     ///< the device; errno tells why
};

/// The capture of one device, from STREAMON to STREAMOFF.
class V4l2Stream {
 public:
  static constexpr std::uint32_t kBuffers = 4;  ///< one held by us, three for the device

  /// @param fd  open, its format set; it must outlive the stream
  static Result<std::unique_ptr<V4l2Stream>> Start(int fd);
  ~V4l2Stream();
  V4l2Stream(const V4l2Stream&) = delete;
  V4l2Stream& operator=(const V4l2Stream&) = delete;

  /// The newest frame that is ready; older ones go back to the device unseen. It stays as it is
  /// until the next call.
  V4l2Answer TakeNewest(V4l2Frame& frame);

 private:
  struct Buffer {
    void* memory;
    std::size_t size;
  };

  explicit V4l2Stream(int fd) : fd_(fd) {}
  Result<void> Map();
  bool GiveBack(std::uint32_t index) const;

  const int fd_;
  std::vector<Buffer> buffers_;
  std::optional<std::uint32_t> held_;  ///< the buffer that the last frame lies in
};

}  // namespace plumbline
