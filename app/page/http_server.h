// HTTP by cpp-httplib on a socket of our own: it parses and formats; who may connect, how many, how
// long and how much is decided here.
#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "app/page/http_library.h"
#include "app/page/http_stream.h"
#include "drivers/os/descriptor.h"
#include "drivers/os/tcp_listener.h"

namespace plumbline {

/// cpp-httplib's parser and formatter without its sockets.
class HttpFormat : public httplib::Server {
 public:
  /// @param answer  fills in the answer to every request whose head could be read
  using Answer = std::function<void(const httplib::Request&, httplib::Response&)>;
  explicit HttpFormat(Answer answer);

  /// Reads one request and writes its answer.
  void Serve(httplib::Stream& stream);
  /// Ends answers that go on and on.
  void End() { svr_sock_ = INVALID_SOCKET; }
};

/// One request a connection, a thread for each, kMostConnections at a time and kMostOfOnePeer of
/// one address; whoever comes beyond is told 503.
class HttpServer {
 public:
  static constexpr std::size_t kMostConnections = 32, kMostOfOnePeer = 16;

  HttpServer(TcpListener listener, StreamLimits limits, HttpFormat::Answer answer);
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
  static void Free(Place& place);

  HttpFormat format_;
  const StreamLimits limits_;
  const TcpListener listener_;
  const Descriptor wake_;
  std::array<Place, kMostConnections> places_;
  std::atomic<int> connections_{0};
  std::atomic<std::uint64_t> turned_away_{0};
  std::thread thread_;
};

}  // namespace plumbline
