// Modbus client connection to a robot controller, TCP or RTU, on top of libmodbus.
//
// libmodbus checks the transaction id, function code and count of a response (not the unit id, the
// protocol id or the length in the header). When a response does not match, libmodbus leaves its
// remaining bytes in the stream. Here every error except an exception response closes the
// connection. Over TCP, so do unread bytes before a request: a late response is never taken for the
// response to a later request. On RTU they are discarded; see ModbusClient for the remaining risk.
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

namespace plumbline::robot {

struct TcpAddress {
  std::string host;  ///< name or address; resolved for each connection attempt
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

/// Not thread-safe. A request is answered or abandoned within the timeout, however slowly the
/// bytes arrive. After a fault the next connection attempt waits 0.1 s, then 0.2 s, up to 1 s;
/// ResetBackOff() restarts at 0.1 s.
///
/// RTU has no transaction id: a response that arrives later than the timeout plus the wait before
/// the next attempt, and has the length then expected, cannot be distinguished from the right one.
class ModbusClient {
 public:
  static constexpr double kFirstWait_s = 0.1;
  static constexpr double kMaxWait_s = 1;

  /// @param unit_id  0..247 or 255
  static Result<ModbusClient> Tcp(const TcpAddress& address, int unit_id, double timeout_s,
                                  Clock clock);
  /// The transmission time of the longest frame is added to the timeout.
  static Result<ModbusClient> Rtu(const SerialLine& line, int unit_id, double timeout_s,
                                  Clock clock);

  /// Connects if necessary. Returns kOk if connected, kWaiting before the next attempt is due.
  LinkResult Connect();
  bool connected() const { return connected_; }
  std::uint64_t connections() const { return connections_; }  ///< established so far

  /// Read(), Write() and WriteOne() require a connection: call Connect() first.
  ///
  /// Reads all registers of a block in one request.
  LinkResult Read(const RegisterBlock& block, std::span<std::uint16_t> words);
  LinkResult Write(int first, std::span<const std::uint16_t> words);  ///< FC16, holding
  LinkResult WriteOne(int address, std::uint16_t word);               ///< FC06, holding

  /// Limits the timeout of the following requests to `max_s`, or to the configured one if that is
  /// shorter.
  void LimitTimeout(double max_s);

  /// Call it after success: the wait after the next fault is kFirstWait_s again.
  void ResetBackOff() { wait_s_ = kFirstWait_s; }

  /// Error of the last failed call; unchanged while Connect() returns kWaiting.
  std::string_view problem() const { return {problem_.data(), problem_size_}; }

 private:
  struct Release {
    void operator()(_modbus* context) const;
  };

  ModbusClient(_modbus* context, std::string peer, bool serial, Clock clock);
  static Result<ModbusClient> Create(_modbus* context, std::string peer, bool serial, int unit_id,
                                     double timeout_s, Clock clock);
  LinkResult Fail(int function, int first, int count);  ///< function 0: connect
  LinkResult FailUnresolved(const char* why);
  void Close();  ///< also schedules the next attempt
  /// True if no unread bytes are pending (RTU: they are discarded); otherwise errno gives the
  /// reason.
  bool ReadyForRequest();

  std::unique_ptr<_modbus, Release> context_;
  std::string peer_;
  std::string host_;  ///< TCP only
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

}  // namespace plumbline::robot
