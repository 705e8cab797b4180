// Fake controller on a loopback socket that can misbehave. It implements FC03, FC06 and FC16
// without libmodbus, so that the client is not tested against its own library.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace plumbline::robot {

using Bytes = std::vector<std::uint8_t>;

class FakeController {
 public:
  /// One received request, its correct response, and the socket to misbehave on.
  struct Exchange {
    int number = 0;      ///< number of the request since the start, from 1
    int connection = 0;  ///< from 1
    int fd = -1;
    Bytes request;
    Bytes answer;
  };
  enum class Then {
    kAnswer,
    kGoOn,
    kClose
  };  ///< send the response; already handled; close the connection
  using Behaviour = std::function<Then(Exchange&)>;

  FakeController();
  ~FakeController();
  FakeController(const FakeController&) = delete;
  FakeController& operator=(const FakeController&) = delete;

  int port() const { return port_; }
  int requests() const { return requests_; }
  int connections() const { return connections_; }

  void Behave(Behaviour behaviour);  ///< empty: respond correctly
  void Set(int address, std::uint16_t word);
  std::uint16_t Get(int address) const;

  /// Called with the address after each register write, while the registers are locked.
  void OnWrite(std::function<void(int, std::array<std::uint16_t, 1024>&)> on_write);

  static bool Send(int fd,
                   const Bytes& bytes);  ///< false if the client closed the connection

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

}  // namespace plumbline::robot
