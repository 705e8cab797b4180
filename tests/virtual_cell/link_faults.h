// Fault injection for the link to the controller, switchable at run time.
#pragma once

#include <string>

#include "tests/virtual_cell/robot_registers.h"

namespace virtual_cell {

struct LinkFaults {
  bool nan = false;            ///< joints and tip are NaN (UR: 0x8000 and INT32_MIN)
  bool jump = false;           ///< the tip is reported 10 m further along x (UR: the largest int16)
  int joint = 0;               ///< from 1; 0: none
  double joint_rad = 0;        ///< reported position of that joint
  double delay_s = 0;          ///< delay of every answer, even if the client has timed out
  double stalled_until_s = 0;  ///< no request is read before this time
  bool exception = false;      ///< every request is answered with exception 06, busy
  bool reset_now = false;      ///< one-shot: all connections are reset
  bool half_close_now = false;  ///< one-shot: the sending half of all connections is closed

  /// Corrupts the reported state; the actual state is not changed.
  void Corrupt(ReportedState& state) const;
};

/// Executes the arguments of a `fault` line, for example `stall 2`, `nan on`, `joint 2 7.0`, `joint
/// off`, `delay 0.3`, `reset`, `half-close`. @param now_s wall clock.
/// @return an error message, or empty
std::string SetFault(const std::string& words, double now_s, LinkFaults& faults);

}  // namespace virtual_cell
