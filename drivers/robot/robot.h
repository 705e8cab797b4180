// What the daemon asks of a robot controller, whatever it is reached through.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "drivers/clock.h"
#include "drivers/robot/push_codec.h"
#include "firmware-like/model/robot_state.h"

namespace plumbline {

enum class LinkResult : std::uint8_t {
  kOk,
  kWaiting,       ///< not connected; the next attempt is not due yet
  kTimeout,       ///< no answer, or no connection, in time
  kLost,          ///< refused, reset or closed by the other side
  kProtocol,      ///< an answer that is none to the question; the link was closed
  kException,     ///< the controller refuses the request; the link stands
  kPushRefused,   ///< not enabled, does not fit, or too large a step
  kPushMismatch,  ///< read back differently from what was written
};

/// Words for a log line: "no answer in time".
std::string_view LinkResultText(LinkResult result);

/// A robot controller. Used by one thread. Every call is bounded in time, connects by itself
/// where it must, and allocates nothing as long as all is well.
class RobotDevice {
 public:
  RobotDevice() = default;
  RobotDevice(const RobotDevice&) = delete;
  RobotDevice& operator=(const RobotDevice&) = delete;
  virtual ~RobotDevice() = default;

  /// Reads one state. `state` is complete where kOk is answered and unchanged otherwise. Its
  /// timestamp and sequence stand still as long as the controller's own refresh counter does.
  virtual LinkResult Read(RobotState& state) = 0;

  /// Writes the next of the points that is due (at most one slot a call, in turn).
  virtual LinkResult Push(std::span<const PushPoint> points) = 0;

  /// Withdraws every slot that may still hold a pushed point: nobody keeps it up to date any more.
  /// Over the connection that stands; gives up at the first fault of it, and after within_s.
  /// @return kOk where no slot holds one
  virtual LinkResult WithdrawAll(double within_s) = 0;

  /// What the last call that was not kOk met, with its place; valid until the next call.
  virtual std::string_view problem() const = 0;
};

}  // namespace plumbline
