// Connection to VISCA cameras: a serial line, a TCP connection, or VISCA over IP (UDP).
#pragma once

#include <memory>
#include <string>

#include "drivers/clock.h"
#include "drivers/os/descriptor.h"
#include "drivers/zoom/visca_address.h"
#include "drivers/zoom/visca_codec.h"

namespace plumbline::zoom {

/// What came of waiting for a packet.
enum class Arrival : std::uint8_t {
  kPacket,
  kNone,  ///< nothing until the deadline
  kLost,  ///< the connection is lost, see problem()
};

/// A flood of packets is read for this long after a deadline [s], not for ever.
inline constexpr double kFlood_s = 0.01;

/// What a packet answers is recognised by the link as far as its transport allows:
///   serial  not at all; the caller resynchronises the line after a timeout
///   TCP     not at all; closed after a timeout, which discards the late answer
///   UDP     by its sequence number; only packets that answer the last request arrive
class ViscaLink {
 public:
  ViscaLink() = default;
  ViscaLink(const ViscaLink&) = delete;
  ViscaLink& operator=(const ViscaLink&) = delete;
  virtual ~ViscaLink() = default;

  virtual bool is_open() const = 0;
  virtual void Close() = 0;
  /// False if an answer cannot be told from a late one to an earlier request: discard what has
  /// arrived before each request.
  virtual bool identifies_answers() const { return false; }
  /// Connects, before the deadline. @return false with problem()
  virtual bool Open(double deadline_s) = 0;
  /// Sends a request; earlier ones are no longer answered. @return false with problem()
  virtual bool Send(const visca::Request& request, double deadline_s) = 0;
  virtual Arrival Receive(double deadline_s, visca::Reply& reply) = 0;
  /// Call if no answer came in time; may close the connection.
  virtual void OnTimeout() {}
  /// What to check if nothing, or only invalid packets arrived: what happened, and the remedy.
  virtual std::string SilenceText(double timeout_s) const = 0;
  virtual std::string GarbageText(int packets) const = 0;

  /// Why the connection failed, with the remedy.
  const std::string& problem() const { return problem_; }

 protected:
  std::string problem_;
};

/// @param baud  of a serial line
std::unique_ptr<ViscaLink> MakeViscaLink(const visca::Address& address, int baud, Clock clock);

}  // namespace plumbline::zoom
