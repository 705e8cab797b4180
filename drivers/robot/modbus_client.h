// One Modbus connection to a controller, TCP or RTU, through libmodbus.
//
// libmodbus compares transaction id, function code and count of an answer (not the unit id, the
// protocol id or the length in the header) and leaves the rest of a wrong one in the stream.
// Here every error except an exception answer closes the connection, and so do bytes that wait
// unread before a request: what comes late is never taken for the answer to a later request.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "drivers/robot/robot.h"
#include "firmware-like/result.h"

struct _modbus;  // libmodbus' modbus_t  NOLINT(bugprone-reserved-identifier)

namespace plumbline {

struct TcpAddress {
  std::string host;  ///< name or address; resolved at each connection, never while one stands
  int port = 502;

  bool operator==(const TcpAddress&) const = default;
};

struct SerialLine {
  std::string device;
  int baud = 19200;
  char parity = 'E';  ///< 'N', 'E' or 'O'
  int stop_bits = 1;

  bool operator==(const SerialLine&) const = default;
};

/// Used by one thread. A request is answered or given up within the time-out, however slowly the
/// bytes drip in. After a fault the next attempt to connect waits 0.1 s, then 0.2 s, .. 1 s;
/// KeepAlive() begins again at 0.1 s.
///
/// RTU has no transaction id: an answer that comes later than the time-out and the wait before
/// the next attempt, and has the length of the one then expected, cannot be told from it.
class ModbusClient {
 public:
  static constexpr double kFirstWait_s = 0.1;
  static constexpr double kLongestWait_s = 1;

  /// @param unit_id  0..247 or 255
  static Result<ModbusClient> Tcp(const TcpAddress& address, int unit_id, double timeout_s,
                                  Clock clock);
  /// The time that the longest frame takes on the line is added to the time-out.
  static Result<ModbusClient> Rtu(const SerialLine& line, int unit_id, double timeout_s,
                                  Clock clock);

  /// kOk where a connection stands; else makes one, or kWaiting before that is due.
  LinkResult Connect();
  bool connected() const { return connected_; }
  std::uint64_t connections() const { return connections_; }  ///< made so far

  /// All registers of a block in one request. Needs a connection, as do the two below.
  LinkResult Read(const RegisterBlock& block, std::span<std::uint16_t> words);
  LinkResult Write(int first, std::span<const std::uint16_t> words);  ///< FC16, holding
  LinkResult WriteOne(int address, std::uint16_t word);               ///< FC06, holding

  /// From now on a request waits at most `most_s`, or the time-out that the client was made with
  /// where that is shorter.
  void LimitTimeout(double most_s);

  /// The other side is well: the next fault waits kFirstWait_s again.
  void KeepAlive() { wait_s_ = kFirstWait_s; }

  /// What the last call that failed met; stays while Connect() answers kWaiting.
  std::string_view problem() const { return {problem_.data(), problem_size_}; }

 private:
  struct Release {
    void operator()(_modbus* context) const;
  };

  ModbusClient(_modbus* context, std::string peer, bool serial, Clock clock);
  static Result<ModbusClient> Create(_modbus* context, std::string peer, bool serial, int unit_id,
                                     double timeout_s, Clock clock);
  LinkResult Fail(int function, int first, int count);  ///< function 0: connecting
  LinkResult FailUnresolved(const char* why);
  void Close();  ///< until the next attempt is due
  /// Nothing lies unread from before (RTU: it is thrown away); else errno says what is wrong.
  bool ReadyForRequest();

  std::unique_ptr<_modbus, Release> context_;
  std::string peer_;
  std::string host_;  ///< of TCP
  bool serial_ = false;
  double timeout_s_ = 0;
  Clock clock_;
  bool connected_ = false;
  std::uint64_t connections_ = 0;
  double wait_s_ = kFirstWait_s;
  double next_attempt_s_ = 0;
  std::array<char, 200> problem_{};
  std::size_t problem_size_ = 0;
};

}  // namespace plumbline
