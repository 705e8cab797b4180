// Virtual Universal Robots controller: the loaded arm of tests/virtual_cell behind an RTDE server.
#pragma once

#include <string>

#include "tests/virtual_cell/virtual_cell.h"
#include "tests/virtual_ur/rtde_server.h"

namespace virtual_ur {

/// The cell keeps its own clients: commands over Modbus, the tracker. RTDE reports its controller.
class VirtualUr {
 public:
  /// @throws std::runtime_error unless the arm has six joints
  VirtualUr(virtual_cell::World world, virtual_cell::MotionProgram program,
            const virtual_cell::VirtualCellOptions& options, int rtde_port = 0);

  RtdeServer& rtde() { return rtde_; }
  virtual_cell::VirtualCell& cell() { return cell_; }

  /// Serves until the next controller cycle is due, and performs it.
  void Step();
  /// "fault WORDS" for RTDE, or a line of the virtual cell. @return "ok" or "error: .."
  std::string Execute(const std::string& line);

 private:
  void Report();

  virtual_cell::VirtualCell cell_;
  RtdeServer rtde_;
  double next_s_;
};

}  // namespace virtual_ur
