// Answers requests from the newest image, and hands what clients wrote to the cycle.
#pragma once

#include <functional>
#include <mutex>

#include "drivers/latest.h"
#include "drivers/modbus/master_watch.h"
#include "drivers/modbus/pdu.h"

namespace plumbline::modbus {

/// What clients have written, and who.
struct WrittenCommands : CommandArea {
  Client writer;                    ///< of the newest command
  Client other;                     ///< that writes commands besides, and
  double two_masters_until_s = -1;  ///< as long as this is ahead [monotonic]
};

/// Shared by all transports. Each request is answered from one image and cannot see another's
/// half-done write. The cycle side never waits: it publishes images and reads the newest commands
/// through Latest; the mutex is between transports only.
class ImageHandler : public RequestHandler {
 public:
  /// @param images    the transports together hold one guard at a time
  /// @param commands  initial content, addresses included
  ImageHandler(const Latest<RegisterImage>& images, const CommandArea& commands,
               DeviceIdentification identification);

  std::size_t Handle(const Client& client, std::span<const std::uint8_t> request,
                     std::span<std::uint8_t, kMaxPduBytes> response) override;

  /// What clients have written, by whole requests. One reader: the cycle.
  Latest<WrittenCommands>::Guard Commands() const { return published_.Read(); }

  /// Where it is told, once, that a second client writes commands. Called in the thread of a
  /// transport. Before the transports start.
  using TwoMastersSink = std::function<void(const Client& writer, const Client& other)>;
  void ReportTwoMasters(TwoMastersSink sink) { on_two_masters_ = std::move(sink); }

 private:
  void NoteWriter(const Client& client);

  const Latest<RegisterImage>& images_;
  const DeviceIdentification identification_;
  std::mutex mutex_;  ///< of the rest, and of the writing side of published_
  WrittenCommands commands_;
  MasterWatch masters_;
  TwoMastersSink on_two_masters_;
  Latest<WrittenCommands> published_;
};

}  // namespace plumbline::modbus
