// One client of the TCP server: its bytes, its frames, its deadline. Knows no other client.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "drivers/modbus/adu.h"
#include "drivers/modbus/request_handler.h"
#include "drivers/modbus/tcp_socket.h"
#include "drivers/os/descriptor.h"

namespace plumbline::modbus {

/// A slot of the server: open while a client has it. Its buffers exist from the start. While
/// answers cannot be sent, nothing may be received.
class TcpConnection {
 public:
  enum class Received {
    kAll,   ///< nothing is left to receive
    kMore,  ///< there may be more
    kEnded,
  };
  struct Answered {
    std::size_t requests = 0;
    bool intact = true;  ///< false: the stream cannot be followed further
  };

  /// Takes a socket that does not block.
  void Open(Descriptor socket, const IpAddress& address, std::int64_t now_ns);
  /// Ends the connection, whoever else holds it.
  void Close();
  /// Gives the descriptor back; the connection goes on where somebody else holds it.
  void LetGo();

  bool open() const { return static_cast<bool>(socket_); }
  int fd() const { return socket_.get(); }
  const IpAddress& address() const { return client_.address; }
  bool asked() const { return asked_; }      ///< has made a request
  bool sending() const { return sending_; }  ///< answers wait to be sent
  /// Between two requests: nothing of a frame was received, and no part of an answer waits.
  bool at_rest() const { return in_size_ == 0 && !sending_; }
  std::int64_t last_request_ns() const { return last_request_ns_; }  ///< or when it connected
  /// Of the incomplete frame or of the sending, a second from its first byte; 0: none.
  std::int64_t deadline_ns() const { return deadline_ns_; }

  /// One receive, however much there is.
  Received Receive();

  /// Answers the complete frames into the output buffer and keeps the rest.
  /// @param unit_id  answered beside 0, 1 and 255
  Answered AnswerFrames(RequestHandler& handler, std::uint8_t unit_id, std::int64_t now_ns);

  /// Sends what waits, as far as it goes. @return false where the connection is lost
  bool Send(std::int64_t now_ns);

 private:
  static constexpr std::size_t kInputBytes = kMaxTcpFrameBytes;
  // Every frame of one full input buffer finds room for the longest answer.
  static constexpr std::size_t kOutputBytes = kInputBytes / kMinTcpFrameBytes * kMaxTcpFrameBytes;

  void Answer(const TcpFrame& frame, RequestHandler& handler, std::uint8_t unit_id);

  Descriptor socket_;
  Client client_;
  bool asked_ = false, sending_ = false;
  std::int64_t last_request_ns_ = 0;
  std::int64_t deadline_ns_ = 0;
  std::size_t in_size_ = 0, out_begin_ = 0, out_end_ = 0;
  std::array<std::uint8_t, kInputBytes> in_;
  std::array<std::uint8_t, kOutputBytes> out_;
};

}  // namespace plumbline::modbus
