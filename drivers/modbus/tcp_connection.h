// Connection of one client to the TCP server: buffers, framing and deadline.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "drivers/modbus/adu.h"
#include "drivers/modbus/request_handler.h"
#include "drivers/modbus/tcp_socket.h"
#include "drivers/os/descriptor.h"

namespace plumbline::modbus {

/// A client slot of the server, open while a client occupies it. Its buffers are part of the
/// object. While responses are pending nothing may be received.
class TcpConnection {
 public:
  enum class Received {
    kAll,   ///< the socket is drained
    kMore,  ///< more may be waiting
    kEnded,
  };
  struct Answered {
    std::size_t requests = 0;
    bool intact = true;                        ///< if false, framing is lost: close the connection
    std::optional<std::uint8_t> other_unit{};  ///< asked for, but not answered
  };

  /// Takes ownership of a non-blocking socket.
  void Open(os::Descriptor socket, const IpAddress& address, std::int64_t now_ns);
  /// Shuts the connection down, also for other holders of its descriptor.
  void Close();
  /// Closes only this descriptor; the connection stays open if another process holds it.
  void Release();

  bool open() const { return static_cast<bool>(socket_); }
  int fd() const { return socket_.get(); }
  const IpAddress& address() const { return client_.address; }
  bool has_requested() const { return has_requested_; }  ///< has sent a request
  bool sending() const { return sending_; }              ///< responses are pending
  /// True if no partial frame is buffered and no response is pending.
  bool between_requests() const { return in_size_ == 0 && !sending_; }
  std::int64_t last_request_ns() const { return last_request_ns_; }  ///< or time of connection
  /// Deadline for completing the partial frame or the pending response, one second after its first
  /// byte; 0 if there is neither.
  std::int64_t deadline_ns() const { return deadline_ns_; }

  /// Calls recv() once.
  Received Receive();

  /// Answers all complete frames into the output buffer and keeps the rest of the input.
  /// @param unit_id  answered in addition to 0, 1 and 255
  Answered AnswerFrames(RequestHandler& handler, std::uint8_t unit_id, std::int64_t now_ns);

  /// Sends as much of the pending responses as the socket accepts. @return false if the connection
  /// is lost
  bool Send(std::int64_t now_ns);

 private:
  static constexpr std::size_t kInputBytes = kMaxTcpFrameBytes;
  // Room for the longest response to every frame of a full input buffer.
  static constexpr std::size_t kOutputBytes = kInputBytes / kMinTcpFrameBytes * kMaxTcpFrameBytes;

  /// @return  false if the frame is for another unit
  bool Answer(const TcpFrame& frame, RequestHandler& handler, std::uint8_t unit_id);

  os::Descriptor socket_;
  Client client_;
  bool has_requested_ = false, sending_ = false;
  std::int64_t last_request_ns_ = 0;
  std::int64_t deadline_ns_ = 0;
  std::size_t in_size_ = 0, out_begin_ = 0, out_end_ = 0;
  std::array<std::uint8_t, kInputBytes> in_;
  std::array<std::uint8_t, kOutputBytes> out_;
};

}  // namespace plumbline::modbus
