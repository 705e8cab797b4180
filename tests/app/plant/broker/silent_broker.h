// Fake broker with configurable replies, which records every byte it receives.
#pragma once

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <mutex>
#include <string>
#include <thread>

namespace plumbline::test {

/// Accepts TCP and, if configured, the client (CONNACK). Never acknowledges a message.
class SilentBroker {
 public:
  explicit SilentBroker(bool lets_in) : listener_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    REQUIRE(bind(listener_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0);
    REQUIRE(getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) == 0);
    REQUIRE(listen(listener_, 4) == 0);
    port_ = ntohs(address.sin_port);
    if (lets_in) {
      thread_ = std::thread([this] { Serve(); });
    }
  }
  ~SilentBroker() {
    ending_ = true;
    if (thread_.joinable()) thread_.join();
    close(listener_);
  }
  SilentBroker(const SilentBroker&) = delete;
  SilentBroker& operator=(const SilentBroker&) = delete;

  int port() const { return port_; }
  /// Bytes received so far.
  std::string Bytes() const {
    const std::lock_guard lock(mutex_);
    return heard_;
  }
  /// Everything that the first client sent until it disconnected.
  std::string AllBytes() {
    if (thread_.joinable()) thread_.join();
    return heard_;
  }

 private:
  bool Readable(int descriptor) const {
    pollfd waiting{descriptor, POLLIN, 0};
    while (!ending_) {
      if (poll(&waiting, 1, 50) > 0) return true;
    }
    return false;
  }
  void Serve() {
    if (!Readable(listener_)) return;
    const int client = accept(listener_, nullptr, nullptr);
    char bytes[4096];
    ssize_t got = 0;
    while (Readable(client) && (got = read(client, bytes, sizeof bytes)) > 0) {
      constexpr char kConnack[] = {0x20, 2, 0, 0};
      if (Bytes().empty() && write(client, kConnack, sizeof kConnack) < 0) break;
      const std::lock_guard lock(mutex_);
      heard_.append(bytes, static_cast<std::size_t>(got));
    }
    close(client);
  }

  const int listener_;
  int port_ = 0;
  std::atomic<bool> ending_{false};
  mutable std::mutex mutex_;
  std::string heard_;
  std::thread thread_;
};

}  // namespace plumbline::test
