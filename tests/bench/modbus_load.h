// Load generators of the Modbus benchmark: well-behaved polling, many clients, hostile clients.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace plumbline::bench {

/// FC03 of `count` registers from address 0, as a TCP frame.
std::vector<std::uint8_t> ReadRequest(int count);

/// A blocking connection to a server on this machine.
class Connection {
 public:
  explicit Connection(int port, int receive_buffer_bytes = 0);
  ~Connection();
  Connection(Connection&& other) noexcept;
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  Connection& operator=(Connection&&) = delete;

  int fd() const { return fd_; }
  bool ok() const { return fd_ >= 0; }
  bool Send(std::span<const std::uint8_t> bytes) const;
  /// Fills `bytes` completely, or gives up after a second without progress.
  bool Receive(std::span<std::uint8_t> bytes) const;

 private:
  int fd_ = -1;
};

struct RoundTrips {
  double p50_us = 0, p99_us = 0;
};

/// Round trips of one client with one request at a time.
RoundTrips MeasureRoundTrips(int port, int polls);

/// Requests per second over `clients` connections, each with one outstanding request.
double MeasureRate(int port, int clients, int requests);

struct GoodClient {
  double worst_ms = 0;
  int polls = 0, reconnections = 0;
  bool locked_out = false;  ///< ten connections in a row without an answer
};

/// Polls every millisecond and reconnects if disconnected; reconnection time counts.
/// @param answer_bytes  size of the response
GoodClient PollEveryMillisecond(int port, std::size_t answer_bytes, double duration_s);

enum class Attack {
  kMixed,        ///< partial frames, dripped bytes, unread answers, unknown functions, abandoned
                 ///< connections, all at once
  kAcceptQueue,  ///< bursts of connections that overflow the accept queue
  kTenThousand,  ///< 10,000 silent connections
  kAbandon,      ///< connections reset or abandoned at once
};

/// Attacks a server on 127.0.0.1 from another process during the lifetime of the object, with a
/// bounded number of connections.
class HostileClients {
 public:
  explicit HostileClients(int port, Attack attack = Attack::kMixed);
  ~HostileClients();
  HostileClients(const HostileClients&) = delete;
  HostileClients& operator=(const HostileClients&) = delete;

 private:
  pid_t pid_ = -1;
};

struct TornReads {
  int reads = 0, torn = 0, images = 0;  ///< images: number of content changes
};

/// Reads blocks of 40 registers, whose contents must be n, n + 1, ..., with eight outstanding
/// requests.
TornReads ReadBlocks(int port, int reads);

}  // namespace plumbline::bench
