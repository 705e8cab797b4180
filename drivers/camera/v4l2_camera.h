// V4L2 camera: USB, PCI or virtual.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/back_off.h"
#include "drivers/camera/camera.h"
#include "drivers/camera/dv_decoder.h"
#include "drivers/camera/pixel_format.h"
#include "drivers/camera/v4l2_device.h"
#include "drivers/camera/v4l2_modes.h"
#include "drivers/clock.h"
#include "drivers/os/descriptor.h"
#include "firmware-like/result.h"

namespace plumbline::camera {

// V4L2 capture stream with memory-mapped buffers.

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

struct V4l2CameraOptions {
  std::string device;  ///< path or name of the camera, see SelectV4l2Device()
  ModeRequest mode = {};
  CameraSettings settings = {};
  DeviceTree tree = {};
  std::string dv_decoder = DvProgram();
};

/// Streams through memory-mapped buffers and returns the newest frame. A frame that is damaged,
/// short or not a JPEG is skipped as long as the timeout allows waiting for another one. A device
/// that is disconnected, or sends nothing for 5 s, is reopened with its mode and settings; if it
/// was selected by serial number, at whatever port it reappears. A DV camera must deliver one whole
/// frame per buffer; its picture is one field with square pixels. `time_s` is the driver's time
/// stamp, of the first or the last line depending on the driver, or our own time if the driver uses
/// another clock or reports an impossible time. `sequence` continues after a reconnection. Opening
/// the device may exceed the timeout: the kernel allows a USB camera several seconds per request.
class V4l2Camera : public Camera {
 public:
  /// Fails for an empty device, an impossible size, a rate outside 0.01..1000 Hz and settings that
  /// no camera can have.
  static Result<std::unique_ptr<Camera>> Create(const V4l2CameraOptions& options, Clock clock);

  CameraResult Read(double timeout_s, CameraFrame& frame) override;
  const CameraIdentity& identity() const override { return identity_; }
  std::string_view problem() const override { return problem_; }
  std::vector<std::string> TakeRemarks() override;
  const std::vector<std::uint8_t>* Bgr() override;

 private:
  V4l2Camera(V4l2CameraOptions options, Clock clock);
  Result<void> Open();
  Result<void> SetMode(const V4l2Device& device);
  void Close();
  CameraResult Disconnect(const std::string& why);
  /// Waits for a frame until the deadline. @return false if the device is gone
  bool WaitForFrame(double deadline_s) const;
  /// Luma of the frame in `raw_`; of DV, `dv_field_` and the size in `raw_` are set, too.
  Result<image::LumaView> Luma();
  void FillFrame(const V4l2Frame& taken, const image::LumaView& luma, CameraFrame& frame);

  const V4l2CameraOptions options_;
  const Clock clock_;
  os::Descriptor fd_;  ///< must outlive stream_
  BackOff back_off_;
  std::string path_;            ///< of the open device, or the configured selector
  RawImage raw_;                ///< negotiated format, size and stride; bytes of the last frame
  double rate_hz_ = 0;          ///< as reported by the device
  double last_activity_s_ = 0;  ///< time of the last data from the device
  double last_time_s_ = 0;      ///< of the last frame
  std::optional<std::uint32_t> last_sequence_;  ///< the driver's
  std::uint64_t sequence_ = 0;                  ///< ours
  std::vector<std::uint8_t> luma_, bgr_, field_luma_;
  std::optional<DvDecoder> dv_;  ///< of a DV camera
  DvField dv_field_;             ///< of the last DV frame
  std::unique_ptr<V4l2Stream> stream_;
  bool named_with_port_ = false;
  CameraIdentity identity_;
  std::vector<std::string> remarks_;
  std::string problem_;
};

/// Extends the driver's 32-bit frame counter to a monotonic 64-bit sequence. Advances by 1 if the
/// driver does not count. Pure.
/// @param last         last sequence returned
/// @param driver_last  driver's counter at that frame; nullopt after a reconnection
/// @param driver_now   driver's counter now
std::uint64_t NextSequence(std::uint64_t last, std::optional<std::uint32_t> driver_last,
                           std::uint32_t driver_now);

}  // namespace plumbline::camera
