// The page's listening socket: who may connect, and how many at a time.
#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "app/page/http_connection.h"
#include "app/page/http_message.h"
#include "drivers/os/descriptor.h"
#include "drivers/os/tcp_listener.h"

namespace plumbline {

/// One request a connection, a thread for each, kMostConnections at a time and kMostOfOnePeer of
/// one address; whoever comes beyond is told 503.
class HttpServer {
 public:
  static constexpr std::size_t kMostConnections = 32, kMostOfOnePeer = 16;

  /// @param answer  fills in the answer to a request; called by several threads
  using Answer = std::function<void(const HttpRequest&, HttpResponse&)>;

  HttpServer(TcpListener listener, ConnectionLimits limits, Answer answer);
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  void Start();
  int connections() const { return connections_; }
  std::uint64_t turned_away() const { return turned_away_; }

 private:
  struct Place {
    std::thread thread;
    std::string peer;
    Descriptor socket;  ///< of the accepting thread
    std::atomic<bool> done{true};
  };
  void Run();
  void Admit(Descriptor socket, const std::string& peer);
  void Serve(Place& place);
  /// Reads one request and writes its answer.
  void Converse(HttpConnection& connection, const std::string& peer) const;
  static void Free(Place& place);

  const Answer answer_;
  const ConnectionLimits limits_;
  const TcpListener listener_;
  const Descriptor wake_;
  std::array<Place, kMostConnections> places_;
  std::atomic<bool> ending_{false};
  std::atomic<int> connections_{0};
  std::atomic<std::uint64_t> turned_away_{0};
  std::thread thread_;
};

}  // namespace plumbline
