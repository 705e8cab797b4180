// V4L2 capture stream with memory-mapped buffers.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "firmware-like/result.h"

namespace plumbline::camera {

/// A frame in a memory-mapped buffer.
struct V4l2Frame {
  std::span<const std::uint8_t> bytes;
  std::uint32_t sequence = 0;
  std::optional<double> time_s;  ///< CLOCK_MONOTONIC; nullopt if the driver uses another clock
};

enum class V4l2StreamResult : std::uint8_t {
  kFrame,
  kNotReady,  ///< no frame is ready
  kDamaged,   ///< only frames that the driver flags as damaged
  kGone,      ///< the device is gone; see errno
};

/// Capture of one device, from STREAMON to STREAMOFF.
class V4l2Stream {
 public:
  static constexpr std::uint32_t kBuffers = 4;  ///< one for the caller, three for the device

  /// @param fd  open device with its format set; must outlive the stream
  static Result<std::unique_ptr<V4l2Stream>> Start(int fd);
  ~V4l2Stream();
  V4l2Stream(const V4l2Stream&) = delete;
  V4l2Stream& operator=(const V4l2Stream&) = delete;

  /// Dequeues the newest frame that is ready and returns older ones to the device. The frame is
  /// valid until the next call.
  V4l2StreamResult TakeNewest(V4l2Frame& frame);

 private:
  struct Buffer {
    void* memory;
    std::size_t size;
  };

  explicit V4l2Stream(int fd) : fd_(fd) {}
  Result<void> Map();
  bool Requeue(std::uint32_t index) const;

  const int fd_;
  std::vector<Buffer> buffers_;
  std::optional<std::uint32_t> dequeued_;  ///< buffer of the last frame
};

}  // namespace plumbline::camera
