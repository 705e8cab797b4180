// Robot controller that answers late, twice, in halves, in the wrong order or for another robot, on
// a TCP socket or a pseudo-terminal. Its Modbus codec shares no code with the program under test.
//
// Each block of registers says when, by which unit and for which block it was sampled:
//   0, 1: time in 0.1 ms since the start, of another unit 1000 s more   2: unit   3: block (1:
//   registers 0.., 2: 100..) 4: number of the refresh               5: check word over the others
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <thread>
#include <vector>

namespace hostile {

using Bytes = std::vector<std::uint8_t>;

inline constexpr double kTimeout_s = 0.010;  ///< of the client; the delays are multiples of it

/// Bytes that are sent later.
struct Emission {
  double delay_s = 0;
  Bytes bytes;
  bool overtakes = false;  ///< not only after everything that is still to be sent
};

/// What a kind of misbehaviour sees of one request.
struct Exchange {
  int number = 0;  ///< of the request, from 1
  bool serial = false;
  Bytes request;
  Bytes answer;           ///< the correct one
  Bytes other_unit;       ///< correct, from the robot with unit id 2
  Bytes previous_answer;  ///< to the request before; empty at first
  Bytes earlier_twin;     ///< to the last request with the same address and count; empty at first
  std::mt19937& random;

  int Below(int n) const { return static_cast<int>(random() % static_cast<unsigned>(n)); }
  bool Once(int in) const { return Below(in) == 0; }
};

using Behaviour = std::function<std::vector<Emission>(Exchange&)>;

/// How the registers get their values.
enum class Refresh {
  kAtRequest,  ///< sampled when the request arrives
  kSometimes,  ///< and sometimes just after a block was read
  kEachRead,   ///< after every request
  kNever,      ///< frozen since the start
};

struct Kind {
  const char* name = "";
  bool tcp = true, rtu = true;
  Behaviour behave;
  Refresh refresh = Refresh::kAtRequest;
  bool limit = false;  ///< documented as indistinguishable: printed, not counted
};

/// All kinds of misbehaviour.
std::vector<Kind> Kinds();

/// Frame parts for the kinds. A frame is a whole message with MBAP header, or with CRC.
Bytes Frame(bool serial, const Bytes& request, std::uint8_t unit, const Bytes& pdu);
std::size_t PduAt(bool serial);

/// Time in 0.1 ms units, as in the registers.
using Ticks = std::function<std::uint32_t()>;

class HostileRobot {
 public:
  /// @param seed    of everything random
  /// @param slower  factor on all delays, for a client whose timeout is that of kTimeout_s
  HostileRobot(const Kind& kind, bool serial, Ticks ticks, unsigned seed, double slower = 1);
  ~HostileRobot();
  HostileRobot(const HostileRobot&) = delete;
  HostileRobot& operator=(const HostileRobot&) = delete;

  int port() const { return port_; }
  const std::string& device() const { return device_; }  ///< of the pseudo-terminal

 private:
  struct Due {
    double at_s = 0;
    Bytes bytes;
  };
  void OpenSocket();
  void OpenTerminal();
  void Run();
  void Serve(int fd);
  bool Receive(int fd, Bytes& stream);
  void Handle(const Bytes& request);
  Bytes AnswerPdu(const Bytes& request_pdu, int unit);
  std::uint16_t Word(int address, int unit, std::uint32_t time) const;
  void SendDue(int fd);

  Kind kind_;
  bool serial_;
  Ticks ticks_;
  double slower_;
  std::mt19937 random_;
  int listener_ = -1, terminal_ = -1, kept_open_ = -1;
  int port_ = 0;
  std::string device_;
  std::atomic<bool> stop_{false};
  std::vector<Due> due_;
  double last_s_ = 0;  ///< when the last emission in order is due
  int number_ = 0;
  Bytes previous_;
  std::vector<std::pair<Bytes, Bytes>> twins_;  ///< request PDU, answer
  std::uint32_t sampled_ = 0;
  std::uint16_t refreshes_ = 1;
  std::thread thread_;
};

}  // namespace hostile
