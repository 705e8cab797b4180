#include "drivers/modbus/tcp_connection.h"

#include <sys/socket.h>

#include <cerrno>
#include <cstring>
#include <span>
#include <utility>

#include "drivers/modbus/pdu.h"

namespace plumbline::modbus {
namespace {

constexpr std::int64_t kClientTimeout_ns = 1'000'000'000;  // to complete a frame, to send responses

}  // namespace

void TcpConnection::Open(os::Descriptor socket, const IpAddress& address, std::int64_t now_ns) {
  client_ = {address, PeerPort(socket.get())};
  socket_ = std::move(socket);
  has_requested_ = sending_ = false;
  last_request_ns_ = now_ns;
  deadline_ns_ = 0;
  in_size_ = out_begin_ = out_end_ = 0;
}

void TcpConnection::Close() {
  ::shutdown(socket_.get(), SHUT_RDWR);
  Release();
}

void TcpConnection::Release() {
  socket_.Reset();
  deadline_ns_ = 0;
}

TcpConnection::Received TcpConnection::Receive() {
  const std::size_t room = in_.size() - in_size_;
  const ssize_t received = ::recv(socket_.get(), in_.data() + in_size_, room, 0);
  if (received < 0 && errno == EAGAIN) return Received::kAll;
  if (received < 0 && errno == EINTR) return Received::kMore;
  if (received <= 0) return Received::kEnded;
  in_size_ += static_cast<std::size_t>(received);
  return static_cast<std::size_t>(received) < room ? Received::kAll : Received::kMore;
}

TcpConnection::Answered TcpConnection::AnswerFrames(RequestHandler& handler, std::uint8_t unit_id,
                                                    std::int64_t now_ns) {
  Answered answered;
  std::size_t begin = 0;
  TcpFrame frame;
  for (;;) {
    frame = ParseTcpFrame({in_.data() + begin, in_size_ - begin});
    if (frame.state != TcpFrame::State::kComplete) break;
    if (!Answer(frame, handler, unit_id)) answered.other_unit = frame.unit;
    ++answered.requests;
    begin += frame.size;
  }
  if (begin > 0) {
    has_requested_ = true;
    last_request_ns_ = now_ns;
    deadline_ns_ = 0;  // the frame it belonged to is complete
    in_size_ -= begin;
    if (in_size_ > 0) std::memmove(in_.data(), in_.data() + begin, in_size_);
  }
  if (in_size_ > 0 && deadline_ns_ == 0) deadline_ns_ = now_ns + kClientTimeout_ns;
  answered.intact = frame.state != TcpFrame::State::kBroken;
  return answered;
}

bool TcpConnection::Answer(const TcpFrame& frame, RequestHandler& handler, std::uint8_t unit_id) {
  std::uint8_t* out = out_.data() + out_end_;
  const std::span<std::uint8_t, kMaxPduBytes> response(out + kMbapBytes, kMaxPduBytes);
  const bool for_us =
      frame.unit == unit_id || frame.unit == 0 || frame.unit == 1 || frame.unit == 255;
  const std::size_t size =
      for_us ? handler.Handle(client_, frame.pdu, response)
             : WriteException(frame.pdu[0], Exception::kGatewayTargetFailed, response);
  if (size == 0) return for_us;
  WriteMbap(std::span<std::uint8_t, kMbapBytes>(out, kMbapBytes), frame.transaction, frame.unit,
            size);
  out_end_ += kMbapBytes + size;
  return for_us;
}

bool TcpConnection::Send(std::int64_t now_ns) {
  if (out_end_ == 0) return true;
  const ssize_t sent =
      ::send(socket_.get(), out_.data() + out_begin_, out_end_ - out_begin_, MSG_NOSIGNAL);
  if (sent < 0 && errno != EAGAIN && errno != EINTR) return false;
  if (sent > 0) out_begin_ += static_cast<std::size_t>(sent);
  const bool all = out_begin_ == out_end_;
  if (all) out_begin_ = out_end_ = 0;
  if (sending_ == all) {  // the pending state changes
    sending_ = !all;
    deadline_ns_ = sending_ || in_size_ > 0 ? now_ns + kClientTimeout_ns : 0;
  }
  return true;
}

}  // namespace plumbline::modbus
