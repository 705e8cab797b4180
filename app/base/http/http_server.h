// HTTP server of the page: accepts connections and limits their number.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <thread>

#include "app/base/http/http_message.h"
#include "drivers/os/descriptor.h"
#include "drivers/os/tcp_listener.h"

namespace plumbline::http {

// HTTP connection with limits on time and size: reads a request head, writes a response.

struct ConnectionLimits {
  double request_s = 5;              ///< from accepting the connection to the end of the head
  std::size_t request_bytes = 8192;  ///< size of the head; bodies are not read
  double write_s = 20;               ///< without the client taking a byte
  double answer_s = 300;             ///< until the client has taken a whole body or picture
};

/// Does not own the descriptor, which must be non-blocking. The time limit covers the whole request
/// head, so that a client cannot hold the connection by sending single bytes.
class HttpConnection {
 public:
  HttpConnection(int fd, ConnectionLimits limits, double now_s);

  enum class Head { kComplete, kTooLong, kTooSlow, kLost };
  /// Reads up to the blank line that ends the head.
  /// @param head  receives what was read, complete or not
  Head ReadHead(std::string& head);

  /// @return  false if the client has disconnected or takes too long
  bool Write(std::string_view bytes);
  /// Waits until the client can take data.
  /// @return  false if it has disconnected or takes too long
  bool IsWritable() const;

 private:
  const int fd_;
  const ConnectionLimits limits_;
  const double read_until_s_;
};

/// One request per connection and one thread per connection. At most kMaxConnections at a time, at
/// most kMaxPerPeer of them from one address; further connections get status 503.
class HttpServer {
 public:
  static constexpr std::size_t kMaxConnections = 32, kMaxPerPeer = 16;

  /// Fills in the response to a request; called from several threads.
  using Answer = std::function<void(const HttpRequest&, HttpResponse&)>;

  HttpServer(os::TcpListener listener, ConnectionLimits limits, Answer answer);
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  void Start();
  int connections() const { return connections_; }
  std::uint64_t rejected() const { return rejected_; }

 private:
  struct Slot {
    std::thread thread;
    std::string peer;
    os::Descriptor socket;  ///< closed by the accepting thread
    std::atomic<bool> done{true};
  };
  void Run();
  void Admit(os::Descriptor socket, const std::string& peer);
  void Serve(Slot& slot);
  /// Reads one request and writes its response.
  void HandleRequest(HttpConnection& connection, const std::string& peer) const;
  static void Free(Slot& slot);

  const Answer answer_;
  const ConnectionLimits limits_;
  const os::TcpListener listener_;
  const os::Descriptor wake_;
  std::array<Slot, kMaxConnections> slots_;
  std::atomic<bool> ending_{false};
  std::atomic<int> connections_{0};
  std::atomic<std::uint64_t> rejected_{0};
  std::thread thread_;
};

}  // namespace plumbline::http
