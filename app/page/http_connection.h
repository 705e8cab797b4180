// One connection of a browser: the head of its request in, an answer out, with limits on time and
// size.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace plumbline {

struct ConnectionLimits {
  double request_s = 5;              ///< from the connection to the end of the request's head
  std::size_t request_bytes = 8192;  ///< of the head; nobody here reads a body
  double write_s = 20;               ///< without one byte of the answer being taken
  double answer_s = 300;             ///< until a body, or one picture, was taken whole
};

/// Does not own the descriptor, which does not block. Whoever sends a byte now and then is cut off
/// when the time of the whole request is over.
class HttpConnection {
 public:
  HttpConnection(int fd, ConnectionLimits limits, double now_s);

  enum class Head { kWhole, kTooLong, kTooSlow, kLost };
  /// Reads as far as the blank line that ends the head.
  /// @param head  what was read of it
  Head ReadHead(std::string& head);

  /// @return  false where the other side left or takes too long
  bool Write(std::string_view bytes);
  /// Waits until something may be written. @return  false where the other side has left
  bool IsWritable() const;

 private:
  const int fd_;
  const ConnectionLimits limits_;
  const double read_until_s_;
};

}  // namespace plumbline
