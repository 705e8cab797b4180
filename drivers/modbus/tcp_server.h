// Modbus TCP server: one thread, many clients, none of which can hold up another.
//
// Each round of the loop takes at most one receive of 260 bytes from each client, answers the
// complete frames in it and sends the answers at once. While a client's answers cannot be sent,
// nothing more is received from it. All buffers exist from the start.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "drivers/modbus/request_handler.h"
#include "drivers/modbus/tcp_connection.h"
#include "drivers/modbus/tcp_socket.h"
#include "drivers/os/descriptor.h"
#include "drivers/os/tcp_listener.h"
#include "drivers/thread_heartbeat.h"
#include "firmware-like/result.h"

namespace plumbline::modbus {

/// What happened to a client, for the log. A hostile one can cause many: limit their rate.
struct TcpServerEvent {
  enum class Kind {
    kStranger,          ///< not in the allow list, closed at accept
    kNoRoom,            ///< every slot is kept for another address
    kEvicted,           ///< made room for a newcomer
    kFrameTimeout,      ///< a frame was not completed within a second of its first byte
    kNotReading,        ///< the answers could not be sent within a second
    kBrokenFrame,       ///< protocol id or length outside Modbus
    kOutOfDescriptors,  ///< the newcomer was closed
  };
  Kind kind = Kind::kStranger;
  std::string_view peer;  ///< address as text, valid during the call
};

struct TcpServerOptions {
  std::string address = "127.0.0.1";  ///< IPv4 or IPv6; "::" takes both
  int port = 502;                     ///< 0: the kernel chooses
  bool offers_connections = false;    ///< whether TakeOffered() is called
  std::uint8_t unit_id = 1;           ///< answered beside 0, 1 and 255
  int max_clients = 32;               ///< raised to the size of `allow` where that is more
  std::vector<std::string> allow{};   ///< client addresses; empty: any
  std::function<void(const TcpServerEvent&)> on_event{};  ///< in the server's thread, or in Start()
};

/// What an earlier process left open.
struct InheritedSockets {
  Descriptor listener{};                  ///< serves instead of a socket of the server's own
  std::vector<Descriptor> connections{};  ///< of clients
};

struct TcpServerCounters {
  std::uint64_t clients = 0;  ///< connected now
  std::uint64_t accepted = 0, refused = 0, evicted = 0, timeouts = 0, not_reading = 0;
  std::uint64_t requests = 0;
};

/// Another unit id than the answered ones gets exception 0x0B (gateway target failed to respond),
/// as the specification has it for a device that is not there, so that the client need not wait.
class TcpServer {
 public:
  /// Opens the socket and starts the thread. @return the server, or why not with a remedy
  static Result<std::unique_ptr<TcpServer>> Start(const TcpServerOptions& options,
                                                  RequestHandler& handler,
                                                  InheritedSockets inherited = {});
  /// Joins the thread and closes all connections; those that were taken stay open with their taker.
  ~TcpServer();
  TcpServer(const TcpServer&) = delete;
  TcpServer& operator=(const TcpServer&) = delete;

  const TcpEndpoint& endpoint() const { return listener_.endpoint(); }
  int port() const { return endpoint().port; }
  /// Any thread.
  TcpServerCounters counters() const;
  const Pulse& heartbeat() const { return pulse_; }

  /// A second descriptor of each connection that has made its first request since the last call,
  /// for whoever keeps it open until a next server takes it over. A connection that this server
  /// ends is ended for the keeper too. Any one thread.
  std::vector<Descriptor> TakeOffered();

 private:
  TcpServer(const TcpServerOptions& options, std::vector<IpAddress> allow, TcpListener listener,
            RequestHandler& handler);

  void Run();
  void TakeOver(std::vector<Descriptor> connections);
  void AcceptNewcomers();
  Descriptor Accept(IpAddress& peer) const;
  bool Admit(Descriptor& socket, const IpAddress& address);
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
  void Tell(TcpServerEvent::Kind kind, const IpAddress& address) const;
  void Watch(const TcpConnection& client, int operation, std::uint32_t events) const;

  struct AtomicCounters {
    std::atomic<std::uint64_t> clients{0}, accepted{0}, refused{0}, evicted{0}, timeouts{0},
        not_reading{0}, requests{0};
  };

  RequestHandler& handler_;
  const std::uint8_t unit_id_;
  const std::vector<IpAddress> allow_;
  const std::function<void(const TcpServerEvent&)> on_event_;
  const bool offers_connections_;
  std::vector<TcpConnection> clients_;
  std::vector<std::atomic<int>> offered_;  ///< for each slot: not taken yet; -1: none
  const TcpListener listener_;
  const Descriptor epoll_, wake_;
  Descriptor spare_;
  std::int64_t now_ns_ = 0;       ///< of this round
  std::int64_t earliest_ns_ = 0;  ///< no deadline lies before it; 0: there is none
  std::int64_t listen_again_ns_ = 0;
  AtomicCounters counters_;
  Pulse pulse_;
  std::thread thread_;
};

}  // namespace plumbline::modbus
