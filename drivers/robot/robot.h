// Interface of a robot controller, independent of its transport.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "drivers/clock.h"
#include "drivers/robot/push_codec.h"
#include "firmware-like/model/robot_state.h"

namespace plumbline::robot {

enum class LinkResult : std::uint8_t {
  kOk,
  kWaiting,       ///< not connected; the next attempt is not due yet
  kTimeout,       ///< no response, or no connection, in time
  kUnknownName,   ///< the host name cannot be resolved
  kRefused,       ///< no route, or nothing accepts connections at this address and port
  kNoDevice,      ///< the serial device is absent or not accessible
  kLost,          ///< the connection was reset or closed by the peer
  kProtocol,      ///< response does not match the request; the connection was closed
  kNoRegisters,   ///< exception 1 to 3: no such function, register or count; still connected
  kNoUnit,        ///< exception 10 or 11: a gateway does not reach the unit id; still connected
  kException,     ///< any other exception; still connected
  kTorn,          ///< the controller refreshed its registers between two requests of the reading
  kNotAccepted,   ///< the controller refuses the setup of the link; problem() says what
  kPushRefused,   ///< push not enabled, value does not fit, or step too large
  kPushMismatch,  ///< read back differently from what was written
};

/// Text for the log, for example "no response in time".
std::string_view LinkResultText(LinkResult result);

/// What to do about a reading that failed; empty if the device's problem() names it.
std::string_view LinkRemedy(LinkResult result);

/// True if the controller answered with an exception.
bool IsException(LinkResult result);

/// A robot controller. Not thread-safe. Every call is bounded in time, connects if necessary, and
/// does not allocate unless it fails.
class RobotDevice {
 public:
  RobotDevice() = default;
  RobotDevice(const RobotDevice&) = delete;
  RobotDevice& operator=(const RobotDevice&) = delete;
  virtual ~RobotDevice() = default;

  /// Reads one state. `state` is complete if kOk is returned and unchanged otherwise. Its timestamp
  /// is the time before the first request. Timestamp and sequence do not advance while the
  /// controller's own refresh counter does not.
  virtual LinkResult Read(model::RobotState& state) = 0;

  /// Writes the next point that is due: at most one slot per call, round-robin.
  virtual LinkResult Push(std::span<const PushPoint> points) = 0;

  /// Withdraws every slot that may still hold a pushed point, because it will no longer be updated.
  /// Uses the existing connection only; gives up at its first fault and after within_s.
  /// @return kOk if no slot holds a point any more
  virtual LinkResult WithdrawAll(double within_s) = 0;

  /// Error of the last call that did not return kOk, with its location; valid until the next call.
  virtual std::string_view problem() const = 0;

  /// What people should know about the controller although the link works, such as a message of
  /// its own; empty if there is nothing new. Valid until the next call.
  virtual std::string_view TakeNotice() { return {}; }
};

}  // namespace plumbline::robot
