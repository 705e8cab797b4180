// What can go wrong on the link to the controller, switched on and off at run time.
#pragma once

#include <string>

#include "tests/virtual_cell/robot_registers.h"

namespace virtual_cell {

struct LinkFaults {
  bool nan = false;             ///< joints and tip are NaN (UR: 0x8000 and INT32_MIN)
  bool jump = false;            ///< the tip is told 10 m further along x (UR: the largest int16)
  int joint = 0;                ///< from 1; 0: none
  double joint_rad = 0;         ///< what that joint is told to be
  double delay_s = 0;           ///< of every answer, also of requests already given up
  double stalled_until_s = 0;   ///< no request is read before this moment
  bool exception = false;       ///< every request is answered by exception 06, busy
  bool reset_now = false;       ///< once: all connections are reset
  bool half_close_now = false;  ///< once: the sending half of all connections is closed

  /// Spoils what is told; what happens stays as it is.
  void Spoil(ReportedState& state) const;
};

/// Obeys the words after `fault`, for example `stall 2`, `nan on`, `joint 2 7.0`, `joint off`,
/// `delay 0.3`, `reset`, `half-close`. @param now_s wall clock.
/// @return empty, or what is wrong with the line.
std::string SetFault(const std::string& words, double now_s, LinkFaults& faults);

}  // namespace virtual_cell
