// Modbus TCP client for the examination of an unknown device: any unit id, one request at a time.
//
// Unlike ModbusClient it reports what came back instead of judging it, and it can try RTU frames.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "drivers/clock.h"
#include "drivers/os/descriptor.h"
#include "drivers/robot/profile.h"

namespace plumbline::robot {

/// What a device did with one request.
struct ReadOutcome {
  enum class Kind : std::uint8_t {
    kWords,
    kException,    ///< `exception` is its code
    kSilent,       ///< no whole response within the timeout
    kClosed,       ///< the device closed the connection, twice
    kForeign,      ///< bytes that are not the response; `what` names the element that differs
    kUnreachable,  ///< no connection; `what` is the reason
  };
  Kind kind = Kind::kSilent;
  int exception = 0;
  std::string what{};
  std::vector<std::uint16_t> words{};

  bool ok() const { return kind == Kind::kWords; }
  /// "exception 0x02 (no such register)", "no answer in time".
  std::string Text() const;
};

/// Meaning of an exception code of the Modbus application protocol: "no such register".
const char* ExceptionText(int code);

/// Not thread-safe. Waits `pause_s` before each request; a connection that the device closed is
/// opened once more.
class RegisterClient {
 public:
  struct Options {
    std::string host;
    int port = 502;
    double timeout_s = 1;
    double pause_s = 0.01;
    int max_requests = 4000;  ///< after which every answer is kSilent
  };

  explicit RegisterClient(Options options) : options_(std::move(options)) {}

  ReadOutcome Read(int unit, const RegisterBlock& block);

  /// True if the device answers a request in RTU frames over TCP, as a gateway does that does not
  /// convert the protocol.
  bool AnswersRtuFrames(int unit);

  int requests() const { return requests_; }
  /// Times that the device closed the connection after it had answered.
  int closings() const { return closings_; }
  const Options& options() const { return options_; }

 private:
  using Bytes = std::span<const std::uint8_t>;
  enum class Framing : std::uint8_t { kTcp, kRtu };

  bool Connect(std::string& why);
  ReadOutcome Exchange(Bytes request, Framing framing, const RegisterBlock& block);

  Options options_;
  os::Descriptor socket_;
  std::uint16_t transaction_ = 0;
  int requests_ = 0, closings_ = 0;
  bool answered_ = false;  ///< on this connection
};

}  // namespace plumbline::robot
