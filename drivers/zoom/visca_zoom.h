// Zoom sensor for a VISCA camera on a serial line.
#pragma once

#include <memory>
#include <string>

#include "drivers/os/descriptor.h"
#include "drivers/zoom/visca_codec.h"
#include "drivers/zoom/zoom_kind.h"
#include "firmware-like/result.h"

namespace plumbline::zoom {

struct ViscaOptions {
  std::string device;      ///< for example /dev/serial/by-id/...
  int baud = 9600;         ///< 9600 or 38400, as set in the camera; 8N1
  int address = 1;         ///< 1..7, position of the camera on the line
  double timeout_s = 0.1;  ///< of one Read()
  std::int32_t optical_max_counts = visca::kOpticalMaxCounts;  ///< above it: digital zoom
};

/// Queries the lens block, or, if the camera does not support it, only the zoom and focus
/// positions; motion is then unknown.
///
/// A VISCA answer does not identify its inquiry. It is matched by sender and length, and after any
/// timeout the line is resynchronised with AddressSet: cameras answer in order, so everything
/// before the reply to AddressSet is stale and discarded. The same is done after a network change
/// and after opening the line. A lost line is reopened after 0.1 s, 0.2 s, up to 1 s.
class ViscaZoom : public ZoomSensor {
 public:
  /// Fails for an unsupported baud rate, an address outside 1..7 or a timeout outside 0.01..10 s.
  /// A missing device is not an error here.
  static Result<std::unique_ptr<ZoomSensor>> Create(const ViscaOptions& options, Clock clock);

  ZoomResult Read(lens::ZoomReading& reading) override;
  std::string_view problem() const override { return problem_; }

 private:
  ViscaZoom(ViscaOptions options, Clock clock);
  bool Open();
  ZoomResult Drain();
  ZoomResult AssignAddresses(double deadline_s);
  ZoomResult ReadLens(lens::ZoomReading& reading, double deadline_s);
  ZoomResult QueryPosition(const visca::Request& request, double deadline_s,
                           std::optional<std::int32_t>& counts);
  /// Sends a request and waits for an answer of `length` bytes, or for kAddressed if `length` is 0.
  ZoomResult Query(const visca::Request& request, std::size_t length, double deadline_s,
                   visca::Reply& answer);
  ZoomResult Wait(std::size_t length, double deadline_s, visca::Reply& answer);
  bool Send(const visca::Request& request, double deadline_s);
  ZoomResult Disconnect(const std::string& why);
  ZoomResult Fail(ZoomResult result, const std::string& why);

  const ViscaOptions options_;
  const Clock clock_;
  os::Descriptor fd_;
  BackOff back_off_;
  visca::Receiver receiver_;
  bool addressed_ = false;
  bool has_block_ = true, has_focus_ = true;  ///< until the camera rejects the inquiry
  std::string problem_;
};

/// Zoom kind "visca".
extern const ZoomKind kViscaKind;

}  // namespace plumbline::zoom
