// Modbus TCP server: one thread, many clients, none of which can stall another.
//
// Each pass of the event loop receives at most 260 bytes from each client, answers the complete
// frames in its buffer and sends the responses at once. While the responses to a client cannot be
// sent, nothing more is received from it. All buffers are allocated at start.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "drivers/modbus/adu.h"
#include "drivers/modbus/request_handler.h"
#include "drivers/modbus/tcp_socket.h"
#include "drivers/os/descriptor.h"
#include "drivers/os/tcp_listener.h"
#include "drivers/thread_heartbeat.h"
#include "firmware-like/result.h"

namespace plumbline::modbus {

// Connection of one client to the TCP server: buffers, framing and deadline.

/// A client slot of the server, open while a client occupies it. Its buffers are part of the
/// object. While responses are pending nothing may be received.
class TcpConnection {
 public:
  enum class Received {
    kAll,   ///< the socket is drained
    kMore,  ///< more may be waiting
    kEnded,
  };
  struct Answered {
    std::size_t requests = 0;
    bool intact = true;                        ///< if false, framing is lost: close the connection
    std::optional<std::uint8_t> other_unit{};  ///< asked for, but not answered
  };

  /// Takes ownership of a non-blocking socket.
  void Open(os::Descriptor socket, const IpAddress& address, std::int64_t now_ns);
  /// Shuts the connection down, also for other holders of its descriptor.
  void Close();
  /// Closes only this descriptor; the connection stays open if another process holds it.
  void Release();

  bool open() const { return static_cast<bool>(socket_); }
  int fd() const { return socket_.get(); }
  const IpAddress& address() const { return client_.address; }
  bool has_requested() const { return has_requested_; }  ///< has sent a request
  bool sending() const { return sending_; }              ///< responses are pending
  /// True if no partial frame is buffered and no response is pending.
  bool between_requests() const { return in_size_ == 0 && !sending_; }
  std::int64_t last_request_ns() const { return last_request_ns_; }  ///< or time of connection
  /// Deadline for completing the partial frame or the pending response, one second after its first
  /// byte; 0 if there is neither.
  std::int64_t deadline_ns() const { return deadline_ns_; }

  /// Calls recv() once.
  Received Receive();

  /// Answers all complete frames into the output buffer and keeps the rest of the input.
  /// @param unit_id  answered in addition to 0, 1 and 255
  Answered AnswerFrames(RequestHandler& handler, std::uint8_t unit_id, std::int64_t now_ns);

  /// Sends as much of the pending responses as the socket accepts. @return false if the connection
  /// is lost
  bool Send(std::int64_t now_ns);

 private:
  static constexpr std::size_t kInputBytes = kMaxTcpFrameBytes;
  // Room for the longest response to every frame of a full input buffer.
  static constexpr std::size_t kOutputBytes = kInputBytes / kMinTcpFrameBytes * kMaxTcpFrameBytes;

  /// @return  false if the frame is for another unit
  bool Answer(const TcpFrame& frame, RequestHandler& handler, std::uint8_t unit_id);

  os::Descriptor socket_;
  Client client_;
  bool has_requested_ = false, sending_ = false;
  std::int64_t last_request_ns_ = 0;
  std::int64_t deadline_ns_ = 0;
  std::size_t in_size_ = 0, out_begin_ = 0, out_end_ = 0;
  std::array<std::uint8_t, kInputBytes> in_;
  std::array<std::uint8_t, kOutputBytes> out_;
};

/// Client event, for the log. A hostile client can cause many: limit their rate.
struct TcpServerEvent {
  enum class Kind {
    kNotAllowed,        ///< not in the allow list; closed on accept
    kNoFreeSlot,        ///< every slot is reserved for another address
    kEvicted,           ///< closed to make room for a new client
    kFrameTimeout,      ///< frame not completed within 1 s of its first byte
    kNotReading,        ///< responses could not be sent within 1 s
    kBrokenFrame,       ///< invalid protocol id or length
    kOutOfDescriptors,  ///< no file descriptor left; the new client was closed
    kOtherUnit,         ///< asks for a unit id that is not answered; once for address and id
  };
  Kind kind = Kind::kNotAllowed;
  std::string_view peer;  ///< address as text, valid during the call
  int unit_id = 0;        ///< for kOtherUnit
};

struct TcpServerOptions {
  std::string address = "127.0.0.1";  ///< IPv4 or IPv6; "::" accepts both
  int port = 502;                     ///< 0: chosen by the kernel
  bool offers_connections = false;    ///< true if the owner calls TakeOffered()
  std::uint8_t unit_id = 1;           ///< answered in addition to 0, 1 and 255
  int max_clients = 32;               ///< raised to the size of `allow` if that is larger
  std::vector<std::string> allow{};   ///< client addresses; empty: any
  /// Called in the server's thread, or in Start().
  std::function<void(const TcpServerEvent&)> on_event{};
};

/// Sockets kept open across a restart of the daemon.
struct InheritedSockets {
  os::Descriptor listener{};                  ///< used instead of opening a new socket
  std::vector<os::Descriptor> connections{};  ///< client connections to continue
};

struct TcpServerCounters {
  std::uint64_t clients = 0;  ///< connected now
  std::uint64_t accepted = 0, refused = 0, evicted = 0, timeouts = 0, not_reading = 0;
  std::uint64_t requests = 0;
};

/// Requests to other unit ids are answered with exception 0x0B (gateway target device failed to
/// respond), which the specification defines for an absent device, so that the client does not run
/// into its timeout.
class TcpServer {
 public:
  /// Opens the socket and starts the thread. @return the server, or the reason and the remedy
  static Result<std::unique_ptr<TcpServer>> Start(const TcpServerOptions& options,
                                                  RequestHandler& handler,
                                                  InheritedSockets inherited = {});
  /// Joins the thread and closes all connections. A connection whose duplicate was taken with
  /// TakeOffered() stays open for the holder of the duplicate if it is between two requests.
  ~TcpServer();
  TcpServer(const TcpServer&) = delete;
  TcpServer& operator=(const TcpServer&) = delete;

  const os::TcpEndpoint& endpoint() const { return listener_.endpoint(); }
  int port() const { return endpoint().port; }
  /// May be called from any thread.
  TcpServerCounters counters() const;
  const ThreadHeartbeat& heartbeat() const { return heartbeat_; }

  /// Duplicate descriptors of the connections that have sent their first request since the last
  /// call. The holder keeps them open across a restart so that the next server can inherit them. A
  /// connection that this server closes is shut down for the holder, too. Call from one thread
  /// only.
  std::vector<os::Descriptor> TakeOffered();

 private:
  TcpServer(const TcpServerOptions& options, std::vector<IpAddress> allow, os::TcpListener listener,
            RequestHandler& handler);

  void Run();
  void TakeOver(std::vector<os::Descriptor> connections);
  void AcceptNewcomers();
  os::Descriptor Accept(IpAddress& peer) const;
  bool Admit(os::Descriptor& socket, const IpAddress& address);
  TcpConnection* FindSlot(const IpAddress& newcomer);
  TcpConnection* ChooseEvicted(const IpAddress& newcomer);
  void RefuseForLackOfDescriptors();
  void Serve(TcpConnection& client, std::uint32_t events);
  bool Answer(TcpConnection& client);
  void Offer(const TcpConnection& client);
  void Withdraw(const TcpConnection& client);
  std::size_t SlotOf(const TcpConnection& client) const;
  void Close(TcpConnection& client);
  void CloseOverdue();
  int WaitTime_ms() const;
  void WatchListener(bool on);
  void ReportEvent(TcpServerEvent::Kind kind, const IpAddress& address, int unit_id = 0) const;
  void ReportOtherUnit(const IpAddress& address, std::uint8_t unit_id);
  void Watch(const TcpConnection& client, int operation, std::uint32_t events) const;

  struct AtomicCounters {
    std::atomic<std::uint64_t> clients{0}, accepted{0}, refused{0}, evicted{0}, timeouts{0},
        not_reading{0}, requests{0};
  };

  RequestHandler& handler_;
  struct OtherUnit {
    IpAddress address;
    std::uint8_t unit_id = 0;
  };
  std::array<OtherUnit, 32> other_units_{};  ///< reported ones; further ones are not
  std::size_t other_units_count_ = 0;
  const std::uint8_t unit_id_;
  const std::vector<IpAddress> allow_;
  const std::function<void(const TcpServerEvent&)> on_event_;
  const bool offers_connections_;
  std::vector<TcpConnection> clients_;
  std::vector<std::atomic<int>> offered_;  ///< per slot: duplicate not taken yet, or -1
  const os::TcpListener listener_;
  const os::Descriptor epoll_, wake_;
  os::Descriptor spare_;
  std::int64_t now_ns_ = 0;       ///< time of this pass
  std::int64_t earliest_ns_ = 0;  ///< lower bound of all deadlines; 0 without one
  std::int64_t listen_again_ns_ = 0;
  AtomicCounters counters_;
  ThreadHeartbeat heartbeat_;
  std::thread thread_;
};

}  // namespace plumbline::modbus
