// HTTP client with control over every byte sent.
#pragma once

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <string>

#include "drivers/clock.h"

namespace plumbline::test {

class PageConnection {
 public:
  explicit PageConnection(int port) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = htons(static_cast<std::uint16_t>(port));
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    fd_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    REQUIRE(connect(fd_, reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0);
  }
  ~PageConnection() { close(fd_); }
  PageConnection(const PageConnection&) = delete;
  PageConnection& operator=(const PageConnection&) = delete;

  void Send(const std::string& bytes) const { send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL); }
  void EndSending() const { shutdown(fd_, SHUT_WR); }
  /// Reads until the server closes or `until` was received, at most `within_s`.
  /// @return  everything received so far
  std::string Read(const std::string& until = "", double within_s = 20) {
    const double end_s = MonotonicSeconds() + within_s;
    while (until.empty() || read_.find(until) == std::string::npos) {
      pollfd waiting{fd_, POLLIN, 0};
      const double left_s = end_s - MonotonicSeconds();
      if (left_s <= 0 || poll(&waiting, 1, static_cast<int>(1e3 * left_s)) <= 0) break;
      char bytes[65536];
      const ssize_t n = recv(fd_, bytes, sizeof bytes, 0);
      if (n <= 0) {
        ended_ = true;
        break;
      }
      read_.append(bytes, static_cast<std::size_t>(n));
    }
    return read_;
  }
  bool ended() const { return ended_; }

 private:
  int fd_ = -1;
  std::string read_;
  bool ended_ = false;
};

struct PageResponse {
  int status = 0;
  std::string head, body;

  explicit PageResponse(const std::string& bytes) {
    const std::size_t end = bytes.find("\r\n\r\n");
    head = bytes.substr(0, end);
    if (end != std::string::npos) body = bytes.substr(end + 4);
    if (head.rfind("HTTP/1.1 ", 0) == 0) status = std::stoi(head.substr(9, 3));
  }
  bool Has(const std::string& header) const { return head.find(header) != std::string::npos; }
};

/// @param headers  each terminated by "\r\n"
inline PageResponse Request(int port, const std::string& path, const std::string& headers = "",
                            const std::string& method = "GET",
                            const std::string& host = "localhost") {
  PageConnection connection(port);
  connection.Send(method + " " + path + " HTTP/1.1\r\nHost: " + host + "\r\n" + headers + "\r\n");
  return PageResponse(connection.Read());
}

}  // namespace plumbline::test
