// A controller on a real loopback socket that a test makes misbehave. It knows FC03, FC06 and
// FC16 by itself, without libmodbus, so that the client is not tested against its own library.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace plumbline {

using Bytes = std::vector<std::uint8_t>;

class FakeController {
 public:
  /// One request as it came, the answer that would be right, and the socket to misbehave on.
  struct Exchange {
    int number = 0;      ///< of requests since the start, from 1
    int connection = 0;  ///< from 1
    int fd = -1;
    Bytes request;
    Bytes answer;
  };
  enum class Then { kAnswer, kGoOn, kClose };  ///< send the answer; it was dealt with; hang up
  using Behaviour = std::function<Then(Exchange&)>;

  FakeController();
  ~FakeController();
  FakeController(const FakeController&) = delete;
  FakeController& operator=(const FakeController&) = delete;

  int port() const { return port_; }
  int requests() const { return requests_; }
  int connections() const { return connections_; }

  void Behave(Behaviour behaviour);  ///< empty: answer rightly
  void Set(int address, std::uint16_t word);
  std::uint16_t Get(int address) const;

  /// Called after each register written, with the address; under the lock of the registers.
  void OnWrite(std::function<void(int, std::array<std::uint16_t, 1024>&)> on_write);

  static bool Send(int fd, const Bytes& bytes);  ///< false where the client hung up

 private:
  void Run();
  void Serve(int fd);
  bool ReadRequest(int fd, Bytes& request) const;
  Bytes AnswerTo(const Bytes& request);

  int listener_ = -1;
  int port_ = 0;
  std::atomic<bool> stop_{false};
  std::atomic<int> requests_{0};
  std::atomic<int> connections_{0};
  mutable std::mutex mutex_;
  Behaviour behaviour_;
  std::function<void(int, std::array<std::uint16_t, 1024>&)> on_write_;
  std::array<std::uint16_t, 1024> registers_{};
  std::thread thread_;
};

}  // namespace plumbline
