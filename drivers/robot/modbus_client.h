// Modbus client connection to a robot controller, TCP or RTU.
//
// libmodbus opens the connection or the serial line. Requests are sent and responses received here,
// because libmodbus checks neither unit id nor header length of a response, and its requests with
// raw bytes all have transaction id 0. Each response is compared with its request as a whole
// (drivers/modbus/adu.h). Every error except an exception response closes the connection.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/modbus/adu.h"
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
/// Over TCP the transaction id names the request; unread bytes before a request close the
/// connection. RTU has no transaction id. A line is therefore synchronised after it was opened and
/// after every fault: it must be silent for as long as the longest frame takes, and then answer a
/// marker, a read whose response is as long as no other, and be silent again. A slave answers in
/// the order of the requests, so an answered marker proves that nothing earlier is still to come,
/// however late it is. If successive requests never have responses that look alike, which is up to
/// the caller, no answer is taken for another then. What remains indistinguishable on a serial
/// line: the response of another slave with the same unit id, and the copy of an answer that
/// arrives after the answer to a later request and in place of the one that it resembles.
class ModbusClient {
 public:
  static constexpr double kFirstWait_s = 0.1;
  static constexpr double kMaxWait_s = 1;

  /// @param unit_id  0..247 or 255
  /// @param markers  for NextMarker()
  static Result<ModbusClient> Tcp(const TcpAddress& address, int unit_id, double timeout_s,
                                  Clock clock, std::vector<RegisterBlock> markers = {});
  /// The transmission time of the longest frame is added to the timeout.
  /// @param markers  at least one
  static Result<ModbusClient> Rtu(const SerialLine& line, int unit_id, double timeout_s,
                                  Clock clock, std::vector<RegisterBlock> markers);

  /// Connects, and synchronises a serial line, if necessary. Returns kOk if connected, kWaiting
  /// before the next attempt is due.
  LinkResult Connect();
  bool connected() const { return connected_; }
  std::uint64_t connections() const { return connections_; }  ///< established so far

  /// Read(), Write() and WriteOne() require a connection: call Connect() first.
  ///
  /// Reads all registers of a block in one request.
  LinkResult Read(const RegisterBlock& block, std::span<std::uint16_t> words);
  LinkResult Write(int first, std::span<const std::uint16_t> words);  ///< FC16, holding
  LinkResult WriteOne(int address, std::uint16_t word);               ///< FC06, holding

  /// The marker whose turn it is; there must be one.
  const RegisterBlock& NextMarker();

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
  using Bytes = std::span<const std::uint8_t>;

  ModbusClient(_modbus* context, std::string peer, bool serial, Clock clock);
  static Result<ModbusClient> Create(_modbus* context, std::string peer, bool serial, int unit_id,
                                     double timeout_s, Clock clock);
  /// Sends the PDU and receives its response. @return the data of the answer to a read
  LinkResult Exchange(Bytes pdu, Bytes* data = nullptr);
  LinkResult Send(Bytes pdu);
  LinkResult Receive(double until_s, modbus::ResponseCheck& check);
  LinkResult DiscardUnread();  ///< fails if they may be a response
  LinkResult Synchronise();
  LinkResult AwaitSilence(bool& was_silent);
  LinkResult Fail(LinkResult result, std::string_view what);
  LinkResult FailWith(int error);
  LinkResult FailUnresolved(const char* why);
  void Close();  ///< also schedules the next attempt

  std::unique_ptr<_modbus, Release> context_;
  std::string peer_;
  std::string host_;  ///< TCP only
  bool serial_ = false;
  std::uint8_t unit_ = 0;
  double configured_timeout_s_ = 0, timeout_s_ = 0;
  Clock clock_;
  bool connected_ = false;
  std::uint64_t connections_ = 0;
  double wait_s_ = kFirstWait_s;
  double next_attempt_s_ = 0;

  std::uint16_t transaction_ = 0;       ///< continues over connections
  bool synchronised_ = false;           ///< serial only
  double longest_frame_s_ = 0;          ///< serial only
  std::vector<RegisterBlock> markers_;  ///< required on a serial line
  std::size_t marker_ = 0;
  std::array<std::uint8_t, modbus::kMaxTcpFrameBytes> request_{}, response_{};
  std::size_t request_size_ = 0, response_size_ = 0;

  std::array<char, 240> problem_{};
  std::size_t problem_size_ = 0;
};

}  // namespace plumbline::robot
