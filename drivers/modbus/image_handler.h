// Request handler that answers from the newest register image and passes written commands to the
// control cycle.
#pragma once

#include <functional>
#include <mutex>

#include "drivers/latest.h"
#include "drivers/modbus/master_watch.h"
#include "drivers/modbus/pdu.h"

namespace plumbline::modbus {

/// Contents of the command area and the clients that wrote it.
struct WrittenCommands : CommandArea {
  Client writer;                    ///< wrote the newest command
  Client other;                     ///< second client that writes commands
  double two_masters_until_s = -1;  ///< `other` is valid until then [monotonic s]
};

/// Shared by all transports. Each request is answered from one image and never sees another
/// request's partial write. The control cycle never waits: it publishes images and reads the newest
/// commands through Latest; the mutex serialises only the transports.
class ImageHandler : public RequestHandler {
 public:
  /// @param images    the handler holds at most one guard at a time
  /// @param commands  addresses and initial contents of the command area
  ImageHandler(const Latest<RegisterImage>& images, const CommandArea& commands,
               DeviceIdentification identification);

  std::size_t Handle(const Client& client, std::span<const std::uint8_t> request,
                     std::span<std::uint8_t, kMaxPduBytes> response) override;

  /// Newest contents of the command area, updated by whole requests. One reader: the control cycle.
  Latest<WrittenCommands>::Guard Commands() const { return published_.Read(); }

  /// Sets the callback that is called once when a second client starts to write commands. It runs
  /// in the thread of a transport. Call before the transports start.
  using TwoMastersSink = std::function<void(const Client& writer, const Client& other)>;
  void ReportTwoMasters(TwoMastersSink sink) { on_two_masters_ = std::move(sink); }

 private:
  void NoteWriter(const Client& client);

  const Latest<RegisterImage>& images_;
  const DeviceIdentification identification_;
  std::mutex mutex_;  ///< guards all members below except the reading side of published_
  WrittenCommands commands_;
  MasterWatch masters_;
  TwoMastersSink on_two_masters_;
  Latest<WrittenCommands> published_;
};

}  // namespace plumbline::modbus
