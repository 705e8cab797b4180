// Broker that lets a client in and then sends it what no publisher may receive.
#pragma once

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <string>
#include <thread>

namespace plumbline::test {

/// Accepts one client after another, answers its CONNECT, and sends `attack` until the client
/// hangs up.
class HostileBroker {
 public:
  /// @param attack  bytes that are sent once
  /// @param flood   bytes that are sent after them, again and again
  HostileBroker(std::string attack, std::string flood)
      : attack_(std::move(attack)),
        flood_(std::move(flood)),
        listener_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    REQUIRE(bind(listener_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0);
    REQUIRE(getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) == 0);
    REQUIRE(listen(listener_, 4) == 0);
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { Serve(); });
  }
  ~HostileBroker() {
    ending_ = true;
    thread_.join();
    close(listener_);
  }
  HostileBroker(const HostileBroker&) = delete;
  HostileBroker& operator=(const HostileBroker&) = delete;

  int port() const { return port_; }
  int clients() const { return clients_; }      ///< accepted so far
  int hung_up() const { return hung_up_; }      ///< of these, gone
  std::uint64_t sent() const { return sent_; }  ///< bytes in all

 private:
  bool Ready(int descriptor, short what) const {
    pollfd waiting{descriptor, what, 0};
    while (!ending_) {
      if (poll(&waiting, 1, 50) > 0) return true;
    }
    return false;
  }
  bool Send(int client, const std::string& bytes) {
    for (std::size_t done = 0; done < bytes.size();) {
      if (!Ready(client, POLLOUT)) return false;
      const ssize_t now =
          send(client, bytes.data() + done, bytes.size() - done, MSG_NOSIGNAL | MSG_DONTWAIT);
      if (now < 0) return false;
      done += static_cast<std::size_t>(now);
      sent_ += static_cast<std::uint64_t>(now);
    }
    return true;
  }
  void Serve() {
    while (Ready(listener_, POLLIN)) {
      const int client = accept(listener_, nullptr, nullptr);
      char bytes[4096];
      if (Ready(client, POLLIN) && read(client, bytes, sizeof bytes) > 0) {
        ++clients_;
        const std::string connack("\x20\x02\x00\x00", 4);
        if (Send(client, connack) && Send(client, attack_)) {
          while (Send(client, flood_)) {
          }
        }
        ++hung_up_;
      }
      close(client);
    }
  }

  const std::string attack_, flood_;
  const int listener_;
  int port_ = 0;
  std::atomic<bool> ending_{false};
  std::atomic<int> clients_{0}, hung_up_{0};
  std::atomic<std::uint64_t> sent_{0};
  std::thread thread_;
};

}  // namespace plumbline::test
