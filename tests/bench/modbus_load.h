// What the Modbus benchmark does to a server: well-behaved polls, many clients, hostile ones.
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
  /// Fills `bytes` whole, or gives up after a second without progress.
  bool Receive(std::span<std::uint8_t> bytes) const;

 private:
  int fd_ = -1;
};

struct RoundTrips {
  double p50_us = 0, p99_us = 0;
};

/// One client, one request at a time.
RoundTrips MeasureRoundTrips(int port, int polls);

/// Requests a second of `clients` connections, each with one request under way.
double MeasureRate(int port, int clients, int requests);

struct GoodClient {
  double worst_ms = 0;
  int polls = 0, reconnections = 0;
  bool refused_for_good = false;  ///< ten connections in a row without an answer
};

/// A client that polls every millisecond and reconnects where it was cut off; that time counts.
/// @param answer_bytes  the size of the server's answer
GoodClient PollEveryMillisecond(int port, std::size_t answer_bytes, double duration_s);

enum class Attack {
  kMixed,        ///< partial frames, dripped bytes, unread answers, unknown functions, abandoned
                 ///< connections, all at once
  kAcceptQueue,  ///< bursts of connections beyond what the listener's queue takes
  kTenThousand,  ///< 10,000 connections that say nothing
  kAbandon,      ///< connections reset or left at once
};

/// One attack on a server of this machine, from another process, until the object ends. Bounded in
/// connections; to 127.0.0.1 only.
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
  int reads = 0, torn = 0, images = 0;  ///< images: how often the content changed
};

/// Block reads of 40 registers whose content must be n, n + 1, ..., eight requests under way.
TornReads ReadBlocks(int port, int reads);

}  // namespace plumbline::bench
