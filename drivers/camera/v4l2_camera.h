// A camera of the kernel's (V4L2): USB, PCI, virtual.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/back_off.h"
#include "drivers/camera/camera.h"
#include "drivers/camera/pixel_format.h"
#include "drivers/camera/v4l2_controls.h"
#include "drivers/camera/v4l2_device.h"
#include "drivers/camera/v4l2_modes.h"
#include "drivers/camera/v4l2_stream.h"
#include "drivers/clock.h"
#include "drivers/os/descriptor.h"
#include "firmware-like/result.h"

namespace plumbline {

struct V4l2CameraOptions {
  std::string device;  ///< path, serial number, or with its port: see SelectV4l2Device
  ModeRequest mode = {};
  CameraSettings settings = {};
  DeviceTree tree = {};
};

/// Streams through shared memory and shows the newest frame. A frame that is damaged, short or no
/// JPEG is passed over while the time-out leaves time for another one. A device that goes away, or
/// sends nothing for 5 s, is opened anew, with its mode and its settings; where it was selected by
/// serial number, at whatever port it comes back. `time_s` is the driver's stamp of the first or
/// the last line, as the driver does it; ours where its stamps are of another clock or impossible.
/// `sequence` goes on after a return. Opening takes as long as the device takes to answer, which
/// the time-out does not bound: the kernel gives a USB camera up to some seconds for a request.
class V4l2Camera : public Camera {
 public:
  /// Refuses an empty device, a negative size, a rate outside 0.01..1000 Hz and settings that no
  /// camera has.
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
  CameraResult Lost(const std::string& why);
  /// Waits for a frame until the deadline. @return false: the device went away
  bool WaitForFrame(double deadline_s) const;
  void Complete(const V4l2Frame& taken, const LumaView& luma, CameraFrame& frame);

  const V4l2CameraOptions options_;
  const Clock clock_;
  Descriptor fd_;  ///< outlives the stream
  BackOff back_off_;
  std::string path_;        ///< of the open device, or what was asked for
  RawImage raw_;            ///< format, size, stride as agreed; bytes of the last frame
  double rate_hz_ = 0;      ///< as the device told
  double heard_s_ = 0;      ///< when it last sent anything
  double last_time_s_ = 0;  ///< of the last frame
  std::optional<std::uint32_t> last_sequence_;  ///< the driver's
  std::uint64_t sequence_ = 0;                  ///< ours
  std::vector<std::uint8_t> luma_, bgr_;
  std::unique_ptr<V4l2Stream> stream_;
  bool named_with_port_ = false;
  CameraIdentity identity_;
  std::vector<std::string> remarks_;
  std::string problem_;
};

/// A driver's 32-bit count as one that goes on: the last one of ours, and the driver's last
/// (nothing after a return) and new one. A driver that does not count gives one more each time.
/// Pure.
std::uint64_t NextSequence(std::uint64_t last, std::optional<std::uint32_t> driver_last,
                           std::uint32_t driver_now);

}  // namespace plumbline
