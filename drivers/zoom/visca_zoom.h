// A camera that tells its zoom by VISCA over a serial line.
#pragma once

#include <memory>
#include <string>

#include "drivers/os/descriptor.h"
#include "drivers/zoom/visca_codec.h"
#include "drivers/zoom/zoom_kind.h"
#include "firmware-like/result.h"

namespace plumbline {

struct ViscaOptions {
  std::string device;      ///< for example /dev/serial/by-id/...
  int baud = 9600;         ///< 9600 or 38400, as the camera is set; 8N1
  int address = 1;         ///< 1..7, place of the camera on the line
  double timeout_s = 0.1;  ///< of one Read()
  std::int32_t optical_max_counts = visca::kOpticalMaxCounts;  ///< beyond it: digital zoom
};

/// Asks for the lens block, and for the zoom (and focus) position alone where the camera does not
/// know the block; motion is then unknown.
///
/// An answer carries no name of its question. It is matched by sender and length, and after any
/// time-out the line is put in order by AddressSet: cameras answer in turn, so that what comes
/// before the answer to that is old and not believed. The same is done after a network change, and
/// after the line was opened. A line that is lost is opened again after 0.1 s, 0.2 s, .. 1 s.
class ViscaZoom : public ZoomSensor {
 public:
  /// Refuses an unknown speed, an address outside 1..7, a time-out outside 0.01..10 s. A missing
  /// device is no error here.
  static Result<std::unique_ptr<ZoomSensor>> Create(const ViscaOptions& options, Clock clock);

  ZoomResult Read(ZoomReading& reading) override;
  std::string_view problem() const override { return problem_; }

 private:
  ViscaZoom(ViscaOptions options, Clock clock);
  bool Open();
  ZoomResult Drain();
  ZoomResult Address(double deadline_s);
  ZoomResult ReadLens(ZoomReading& reading, double deadline_s);
  ZoomResult AskPosition(const visca::Request& request, double deadline_s,
                         std::optional<std::int32_t>& counts);
  /// Sends and waits for an answer of that length, or for kAddressed where length is 0.
  ZoomResult Ask(const visca::Request& request, std::size_t length, double deadline_s,
                 visca::Reply& answer);
  ZoomResult Wait(std::size_t length, double deadline_s, visca::Reply& answer);
  bool Send(const visca::Request& request, double deadline_s);
  ZoomResult Lost(const std::string& why);
  ZoomResult Fail(ZoomResult result, const std::string& why);

  const ViscaOptions options_;
  const Clock clock_;
  Descriptor fd_;
  BackOff back_off_;
  visca::Receiver receiver_;
  bool addressed_ = false;
  bool has_block_ = true, has_focus_ = true;  ///< until the camera says otherwise
  std::string problem_;
};

/// A camera on a serial line.
extern const ZoomKind kViscaKind;

}  // namespace plumbline
