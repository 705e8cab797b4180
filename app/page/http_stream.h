// A connection as cpp-httplib reads and writes it, with limits on time and size.
#pragma once

#include <array>
#include <cstddef>
#include <string>

#include "app/page/http_library.h"

namespace plumbline {

struct StreamLimits {
  double request_s = 5;              ///< from the connection to the end of the request's head
  std::size_t request_bytes = 8192;  ///< of the head; nobody here reads a body
  double write_s = 20;               ///< without one byte of the answer being taken
  double answer_s = 300;             ///< until a body, or one picture, was taken whole
};

/// Does not own the descriptor, which does not block. Whoever sends a byte now and then is cut off
/// when the time of the whole request is over.
class HttpStream final : public httplib::Stream {
 public:
  HttpStream(int fd, std::string peer, StreamLimits limits, double now_s);

  bool is_readable() const override;
  bool is_writable() const override;  ///< and the other side has not left
  ssize_t read(char* bytes, size_t size) override;
  ssize_t write(const char* bytes, size_t size) override;
  void get_remote_ip_and_port(std::string& ip, int& port) const override;
  void get_local_ip_and_port(std::string& ip, int& port) const override;
  socket_t socket() const override { return fd_; }

  bool too_long() const { return too_long_; }
  bool too_slow() const { return too_slow_; }
  bool wrote() const { return wrote_; }

 private:
  const int fd_;
  const std::string peer_;
  const StreamLimits limits_;
  const double read_until_s_;
  std::array<char, 2048> buffer_;
  std::size_t begin_ = 0, end_ = 0, taken_ = 0;
  bool too_long_ = false, too_slow_ = false, wrote_ = false;
};

}  // namespace plumbline
