// What may happen between a controller and its client, in virtual time.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <random>
#include <string>
#include <vector>

#include "tests/motion_robots/controller.h"

namespace motion_robots {

/// The client under test.
class Client {
 public:
  virtual ~Client() = default;
  struct Datagram {
    bool foreign = false;  ///< from another address than the controller's
    std::string bytes;
  };
  /// Datagrams that are there together. @return  the answers
  virtual std::vector<std::string> Receive(const std::vector<Datagram>& datagrams,
                                           double now_s) = 0;
  virtual void Idle(double now_s) = 0;
  /// Killed and started again: nothing is remembered.
  virtual void Restart(double now_s) = 0;
  /// What the client is told besides packets changes: an enable, a load, a radius.
  virtual void Disturb(std::mt19937& random) = 0;
};

inline constexpr std::array kHostileKinds = {
    "packet lost",
    "packet one cycle late",
    "packet several cycles late",
    "packet doubled",
    "packets swapped",
    "packets held up, then all at once",
    "foreign sender, other text",
    "foreign sender, the same packet",
    "packet truncated",
    "packet huge",
    "number far ahead",
    "number slightly ahead, from nobody known",
    "number repeated",
    "number long ago",
    "joints not a number",
    "a joint missing",
    "all joints missing",
    "joints of another sign",
    "joints far outside",
    "random bytes",
    "empty datagram",
    "answer lost",
    "answers lost in a row",
    "answer one cycle late",
    "answer doubled",
    "answers swapped",
    "both ways interrupted for a moment",
    "both ways interrupted beyond the timeout",
    "interface off and on again",
    "interface off and on again with other numbers",
    "number wraps",
    "client held up",
    "client killed and started again",
    "corrections paused and resumed",
    "corrections paused and resumed, both packets at once",
    "numbers begin anew, all packets at once",
    "conditions of the correction change",
};
inline constexpr std::size_t kKinds = kHostileKinds.size();

struct WireOptions {
  double cycle_s = 0.004;
  double trouble = 0.02;  ///< share of cycles in which something happens
  unsigned seed = 1;
};

class HostileWire {
 public:
  HostileWire(Controller& controller, Client& client, WireOptions options);

  /// @param only  one kind; negative: all of them
  void Run(long cycles, int only = -1);

  const std::array<long, kKinds>& happened() const { return happened_; }
  long packets() const { return packets_; }

 private:
  void Cycle(int only);
  /// Does what a kind does to this cycle's packet.
  void Disturb(std::size_t kind);
  void Deliver(const std::vector<Client::Datagram>& datagrams);
  void Pause(int cycles);
  int Whole(int low, int high) { return std::uniform_int_distribution(low, high)(random_); }

  Controller& controller_;
  Client& client_;
  WireOptions options_;
  std::mt19937 random_;
  double now_s_ = 1000;
  long packets_ = 0;
  std::array<long, kKinds> happened_{};

  struct Later {
    long cycle;
    std::string bytes;
    bool first = false;  ///< before the packet of that cycle
  };
  std::deque<Later> late_packets_, late_answers_;
  std::vector<Client::Datagram> held_;  ///< in the client's socket while it is held up
  std::vector<std::vector<Client::Datagram>> batches_;  ///< of this cycle
  std::string packet_;
  long cycle_ = 0;
  int client_held_ = 0, wire_held_ = 0, interrupted_ = 0, answers_lost_ = 0, pause_ = 0;
  int inactive_ = 0;  ///< cycles until corrections are applied again
  bool renumber_ = false;
  int answers_ = 0;  ///< 0 as they are, 1 late, 2 doubled, 3 swapped with the next
};

}  // namespace motion_robots
