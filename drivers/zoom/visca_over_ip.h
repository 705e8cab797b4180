// VISCA over IP: the link to a camera by UDP, with header and sequence numbers.
#pragma once

#include "drivers/zoom/camera_socket.h"
#include "drivers/zoom/visca_link.h"

namespace plumbline::zoom {

/// The sequence is reset on a new socket: a late answer, whose number may be used again, goes to
/// the previous port. This is done when the link opens, when the camera rejects a number (it was
/// restarted, or another controller has reset it), and after two requests during which nothing
/// arrived. A camera that ignores the reset is asked nevertheless.
class ViscaOverIp : public ViscaLink {
 public:
  ViscaOverIp(const visca::Address& address, Clock clock)
      : address_(address), clock_(clock), host_(address) {}

  bool is_open() const override { return static_cast<bool>(fd_); }
  void Close() override { fd_.Reset(); }
  bool Open(double deadline_s) override;
  bool identifies_answers() const override { return true; }
  bool Send(const visca::Request& request, double deadline_s) override;
  Arrival Receive(double deadline_s, visca::Reply& reply) override;
  std::string SilenceText(double timeout_s) const override;
  std::string GarbageText(int packets) const override;

 private:
  bool Reset(double deadline_s);
  bool SendNext();
  bool SendDatagram(const visca::Datagram& datagram);
  Arrival ReceiveDatagram(double deadline_s, visca::DatagramReply& found);

  const visca::Address address_;
  const Clock clock_;
  CameraHost host_;
  os::Descriptor fd_;
  visca::Request request_;
  std::uint32_t sequence_ = 0;  ///< of the last request
  int silent_requests_ = 0;     ///< since anything arrived
  bool heard_ = true;           ///< anything from this address of the camera's name
  // Since the last request:
  int other_sequences_ = 0, without_header_ = 0, resets_ = 0;
  std::uint32_t other_sequence_ = 0;
};

}  // namespace plumbline::zoom
