// Request handler that answers from the newest register image and passes written commands to the
// control cycle.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <mutex>
#include <optional>

#include "drivers/latest.h"
#include "drivers/modbus/client.h"
#include "drivers/modbus/pdu.h"

namespace plumbline::modbus {

// Detector of conflicting masters: two clients that both write the command window.

/// Two masters are
///   - clients with different addresses that write commands within kConflictWindow_s, or
///   - two connections from one address if the older writes again after the younger has written:
///     a master that reconnects never uses its old connection again.
/// Pure; allocates nothing.
class MasterWatch {
 public:
  static constexpr double kConflictWindow_s = 5;

  /// Records that `writer` has written commands. @return the other master if there are two
  std::optional<Client> RecordWrite(const Client& writer, double now_s);

 private:
  struct Write {
    Client client;
    double time_s = 0;
  };
  static constexpr std::size_t kMaxClients = 8;  ///< remembered, most recent first
  std::array<Write, kMaxClients> writes_;
  std::size_t count_ = 0;
};

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
