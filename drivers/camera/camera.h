// Interface of a camera, independent of how it is connected.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "firmware-like/image/luma_view.h"

namespace plumbline::camera {

enum class CameraResult : std::uint8_t {
  kFrame,     ///< a frame newer than the previous one
  kNoFrame,   ///< connected, but no frame arrived in time
  kWaiting,   ///< not connected; the next attempt is not due yet
  kLost,      ///< cannot be opened, or was disconnected
  kUnusable,  ///< frames arrive but cannot be decoded (format, size or damage)
  kEnded,     ///< end of a recording that does not repeat
};

/// Text for the log, for example "no frame in time".
std::string_view CameraResultText(CameraResult result);

/// One frame.
struct CameraFrame {
  image::LumaView luma;  ///< owned by the camera, valid until its next call
  double time_s = 0;     ///< monotonic time of exposure; the driver decides which line it refers to
  std::uint64_t sequence = 0;  ///< ascending; a gap means that frames were lost on the way
};

/// Identity of the camera, for the lens store and the log. Empty before the first connection.
struct CameraIdentity {
  std::string serial;  ///< with the port appended if another camera has the same serial number
  std::string mode;    ///< format, size and rate, "YUYV 1920x1080@30"; a lens is valid for one mode
};

/// A camera. Not thread-safe. A call connects if necessary and returns within its timeout,
/// whatever the device does. Only the latest frame is returned: older ones are dropped, not queued.
class Camera {
 public:
  Camera() = default;
  Camera(const Camera&) = delete;
  Camera& operator=(const Camera&) = delete;
  virtual ~Camera() = default;

  /// Waits for a frame. `frame` is complete if kFrame is returned and unchanged otherwise.
  virtual CameraResult Read(double timeout_s, CameraFrame& frame) = 0;

  virtual const CameraIdentity& identity() const = 0;

  /// Why the last call returned no frame, with the location and the remedy; valid until the next
  /// call.
  virtual std::string_view problem() const = 0;

  /// Warnings since the last call that do not prevent frames, such as a setting that the device
  /// rejected or changed. One sentence each, with the location.
  virtual std::vector<std::string> TakeRemarks() { return {}; }

  /// The last frame in colour, see BgrOf(); converted on demand, valid until the next call. nullptr
  /// if there is no frame or no colour.
  virtual const std::vector<std::uint8_t>* Bgr() { return nullptr; }
};

}  // namespace plumbline::camera
