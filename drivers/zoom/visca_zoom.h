// Zoom sensor for a VISCA camera on a serial line or in the network.
#pragma once

#include <memory>
#include <string>

#include "drivers/zoom/visca_codec.h"
#include "drivers/zoom/visca_link.h"
#include "drivers/zoom/zoom_kind.h"
#include "firmware-like/result.h"

namespace plumbline::zoom {

struct ViscaOptions {
  std::string device;      ///< for example /dev/serial/by-id/..., or an address: 192.168.1.9
  std::string transport;   ///< "serial", "udp", "tcp"; empty: see visca::AddressFrom()
  int baud = 9600;         ///< of a serial line: 9600 or 38400, as set in the camera; 8N1
  int address = 1;         ///< 1..7, position of the camera on the line
  double timeout_s = 0.1;  ///< of one Read()
  std::int32_t optical_max_counts = visca::kOpticalMaxCounts;  ///< above it: digital zoom
};

/// Queries the lens block, or, if the camera does not support it, only the zoom and focus
/// positions; motion is then unknown.
///
/// A VISCA answer does not identify its inquiry. It is matched by sender and length, in the network
/// also as ViscaLink says. A serial line is resynchronised with AddressSet after any timeout, after
/// a network change and after it was opened: cameras answer in order, so everything before the
/// reply to AddressSet is stale and discarded. A lost connection is opened again after 0.1 s, 0.2
/// s, up to 1 s.
class ViscaZoom : public ZoomSensor {
 public:
  /// Fails for a device that is neither a path nor an address, an unsupported baud rate, an address
  /// outside 1..7 or a timeout outside 0.01..10 s.
  /// A missing device is not an error here.
  static Result<std::unique_ptr<ZoomSensor>> Create(const ViscaOptions& options, Clock clock);

  ZoomResult Read(lens::ZoomReading& reading) override;
  std::string_view problem() const override { return problem_; }

 private:
  ViscaZoom(const ViscaOptions& options, const visca::Address& address, Clock clock);
  bool Open(double deadline_s);
  ZoomResult Drain();
  void NoteNetworkChange(const visca::Reply& reply);
  ZoomResult AssignAddresses(double deadline_s);
  ZoomResult ReadLens(lens::ZoomReading& reading, double deadline_s);
  ZoomResult QueryPosition(const visca::Request& request, double deadline_s,
                           std::optional<std::int32_t>& counts);
  /// Sends a request and waits for an answer of `length` bytes, or for kAddressed if `length` is 0.
  ZoomResult Query(const visca::Request& request, std::size_t length, double deadline_s,
                   visca::Reply& answer);
  ZoomResult Wait(std::size_t length, double deadline_s, visca::Reply& answer);
  ZoomResult Disconnect(const std::string& why);
  ZoomResult Fail(ZoomResult result, const std::string& why);

  const ViscaOptions options_;
  const visca::Address address_;
  const Clock clock_;
  const std::unique_ptr<ViscaLink> link_;
  BackOff back_off_;
  bool addressed_ = false;                    ///< in the network: always, a camera has address 1
  bool has_block_ = true, has_focus_ = true;  ///< until the camera rejects the inquiry
  std::string problem_;
};

/// Zoom kind "visca".
extern const ZoomKind kViscaKind;

}  // namespace plumbline::zoom
