#include "drivers/zoom/visca_over_ip.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>

namespace plumbline::zoom {
namespace {

constexpr int kSilentRequests = 2;
constexpr double kResetShare = 0.3;  ///< of the time left that the answer to a reset may take

}  // namespace

bool ViscaOverIp::Open(double deadline_s) {
  Close();
  silent_requests_ = 0;
  if (!heard_) host_.TryNext();
  heard_ = false;
  do {
    if (Reset(deadline_s)) return true;
  } while (fd_ && host_.TryNext() && clock_() < deadline_s);
  return false;
}

/// Sets the sequence number to 0 on both ends.
bool ViscaOverIp::Reset(double deadline_s) {
  const double now_s = clock_();
  if (!host_.Connect(deadline_s - now_s, fd_, problem_)) return false;
  sequence_ = 0;
  if (!SendDatagram(visca::SequenceReset())) return false;
  const double until_s = now_s + kResetShare * (deadline_s - now_s);
  for (;;) {
    visca::DatagramReply found;
    const Arrival arrival = ReceiveDatagram(until_s, found);
    if (arrival != Arrival::kPacket) return arrival == Arrival::kNone;
    if (found.kind == visca::DatagramReply::Kind::kSequenceReset) return true;
  }
}

bool ViscaOverIp::Send(const visca::Request& request, double deadline_s) {
  if (silent_requests_ >= kSilentRequests && !Open(deadline_s)) return false;
  request_ = request;
  ++silent_requests_;
  other_sequences_ = without_header_ = resets_ = 0;
  return SendNext();
}

bool ViscaOverIp::SendNext() {
  return SendDatagram(visca::InquiryDatagram(request_, ++sequence_));
}

bool ViscaOverIp::SendDatagram(const visca::Datagram& datagram) {
  ssize_t sent = 0;
  do {
    sent = send(fd_.get(), datagram.bytes.data(), datagram.size, MSG_NOSIGNAL);
  } while (sent < 0 && errno == EINTR);
  if (sent >= 0 || errno == EAGAIN) return true;  // a full queue loses it, as any router may
  problem_ = host_.ErrorText(errno);
  return false;
}

Arrival ViscaOverIp::Receive(double deadline_s, visca::Reply& reply) {
  using Kind = visca::DatagramReply::Kind;
  for (;;) {
    visca::DatagramReply found;
    const Arrival arrival = ReceiveDatagram(deadline_s, found);
    if (arrival != Arrival::kPacket) return arrival;
    silent_requests_ = 0;
    switch (found.kind) {
      case Kind::kReply:
        if (found.sequence == sequence_) {
          reply = found.reply;
          return Arrival::kPacket;
        }
        ++other_sequences_;
        other_sequence_ = found.sequence;
        break;
      case Kind::kUnexpectedSequence:
        if (resets_ > 0) break;
        ++resets_;
        if (!Reset(deadline_s) || !SendNext()) return Arrival::kLost;
        break;
      case Kind::kWithoutHeader:
        ++without_header_;
        break;
      case Kind::kSequenceReset:  // late
        break;
      case Kind::kMalformed:
        reply = {};
        return Arrival::kPacket;
    }
  }
}

Arrival ViscaOverIp::ReceiveDatagram(double deadline_s, visca::DatagramReply& found) {
  for (;;) {
    std::array<std::uint8_t, 64> bytes;  // a longer one is malformed in any case
    const ssize_t size = recv(fd_.get(), bytes.data(), bytes.size(), 0);
    if (size >= 0) {
      heard_ = true;
      found = visca::ReplyFromDatagram(std::span(bytes).first(static_cast<std::size_t>(size)));
      return clock_() > deadline_s + kFlood_s ? Arrival::kNone : Arrival::kPacket;
    }
    if (errno == EINTR) continue;
    if (errno != EAGAIN) {
      problem_ = host_.ErrorText(errno);
      return Arrival::kLost;
    }
    const double left_s = deadline_s - clock_();
    if (left_s <= 0) return Arrival::kNone;
    pollfd wait{.fd = fd_.get(), .events = POLLIN, .revents = 0};
    poll(&wait, 1, static_cast<int>(std::ceil(1e3 * left_s)));
  }
}

std::string ViscaOverIp::SilenceText(double timeout_s) const {
  if (without_header_ > 0) {
    return "answers without the header of VISCA over IP. Set transport = \"tcp\".";
  }
  if (resets_ > 0) {
    return "rejects the sequence numbers again after a reset. Check whether another controller "
           "uses "
           "the camera.";
  }
  if (other_sequences_ > 0) {
    return fmt::format(
        "answers only with other sequence numbers ({} instead of {}): later than {:.0f} ms, or it "
        "does not count. Increase timeout_ms, or set transport = \"tcp\".",
        other_sequence_, sequence_, 1e3 * timeout_s);
  }
  return fmt::format(
      "no answer within {:.0f} ms. Check that it is on, its address and the network cable, and "
      "that "
      "VISCA over IP is enabled in it; if it speaks VISCA over TCP only, set transport = \"tcp\".",
      1e3 * timeout_s);
}

std::string ViscaOverIp::GarbageText(int packets) const {
  return fmt::format(
      "{} datagrams that are not VISCA over IP. Check that port {} is the camera's port for it.",
      packets, address_.port);
}

}  // namespace plumbline::zoom
