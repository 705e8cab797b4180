// HTTP connection with limits on time and size: reads a request head, writes a response.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace plumbline::display {

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

}  // namespace plumbline::display
