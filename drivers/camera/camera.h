// What the daemon asks of a camera, whatever it is reached through.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "firmware-like/lens/luma_view.h"

namespace plumbline {

enum class CameraResult : std::uint8_t {
  kFrame,     ///< a frame newer than the last one
  kNoFrame,   ///< connected, but none came in time
  kWaiting,   ///< not connected; the next attempt is not due yet
  kLost,      ///< cannot be opened, or went away
  kUnusable,  ///< frames come that cannot be read: format, size, damaged data
  kEnded,     ///< a recording without repeat is over
};

/// Words for a log line: "no frame in time".
std::string_view CameraResultText(CameraResult result);

/// One image.
struct CameraFrame {
  LumaView luma;               ///< of the camera's own memory, until its next call
  double time_s = 0;           ///< when it was taken, monotonic: begin of the read-out
  std::uint64_t sequence = 0;  ///< counts up; a gap tells frames that were lost before us
};

/// Who the camera is, for the lens store and the log. Empty before it was connected.
struct CameraIdentity {
  std::string serial;  ///< of two cameras with one serial number: with the port added
  std::string mode;    ///< format, size and rate, "YUYV 1920x1080@30": a lens belongs to it
};

/// A camera. Used by one thread. A call connects by itself where it must and ends within its
/// time-out, whatever the device does. Always the latest frame: older ones are dropped, not queued.
class Camera {
 public:
  Camera() = default;
  Camera(const Camera&) = delete;
  Camera& operator=(const Camera&) = delete;
  virtual ~Camera() = default;

  /// `frame` is complete where kFrame is answered and unchanged otherwise.
  virtual CameraResult Read(double timeout_s, CameraFrame& frame) = 0;

  virtual const CameraIdentity& identity() const = 0;

  /// What the last call that gave no frame met, with its place and what to do; valid until the next
  /// call.
  virtual std::string_view problem() const = 0;

  /// What happened since the last call that does not keep frames from coming: a setting that the
  /// device refused or changed. One sentence each, with its place.
  virtual std::vector<std::string> TakeRemarks() { return {}; }

  /// The last frame in colour, see BgrOf(); until the next call. Converted when asked for. Null
  /// where there is no frame, or no colour in it.
  virtual const std::vector<std::uint8_t>* Bgr() { return nullptr; }
};

}  // namespace plumbline
