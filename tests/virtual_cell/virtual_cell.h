// Virtual cell: world, controller, link and instrument on one clock.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/virtual_cell/joint_replay.h"
#include "tests/virtual_cell/modbus_server.h"
#include "tests/virtual_cell/tracker.h"

namespace virtual_cell {

struct VirtualCellOptions {
  std::string address = "127.0.0.1";
  int port = 0;  ///< 0: the kernel's choice
  int tracker_port = 0;
  Profile profile = Profile::kUr;
  bool idle = false;         ///< no program: the controller only executes commands
  std::string hold_at = {};  ///< point at which the program stays
  double time_scale = 1;
  double tracker_noise_mm = 0;
  bool tracker_noise_of_standstill = false;  ///< see Tracker
  unsigned tracker_seed = 1;
  std::vector<Vec3> reflectors_T = {};                      ///< at most four
  std::vector<std::pair<double, double>> temperature = {};  ///< (time [s], T [C]), times rising
  std::vector<ReplayRow> replay = {};                       ///< rows instead of a program
  double row_rate_hz = 10;
  MotionLimits limits = {};
};

class VirtualCell {
 public:
  VirtualCell(World world, MotionProgram program, VirtualCellOptions options);

  int robot_port() const { return robot_server_.port(); }
  int tracker_port() const { return tracker_server_.port(); }

  /// Waits for clients for at most `wait_s` of wall time, then advances the world to `now_s` of
  /// wall time and serves. `extra_socket` (or -1) wakes it too.
  void Step(double now_s, double wait_s, int extra_socket = -1);

  /// Executes one console line (README.md lists them). @return "ok" or "error: .."
  std::string Execute(const std::string& line);
  bool QuitRequested() const { return quit_; }

  const Controller& controller() const { return controller_; }
  const Truth& truth() const { return truth_; }

 private:
  void Advance(double dt);
  void PlayRows();
  double Temperature() const;
  bool Remote() const { return replaying_ ? false : options_.idle || runner_.Holding(); }
  ReportedState Reported() const;

  VirtualCellOptions options_;
  World world_;
  Controller controller_;
  ProgramRunner runner_;
  RegisterBank robot_bank_;
  Tracker tracker_;
  CommandBlock commands_;
  ModbusServer robot_server_, tracker_server_;
  LinkFaults faults_;
  bool replaying_;
  std::optional<double> started_s_;
  double wall_s_ = 0;  ///< since the start
  double time_s_ = 0;  ///< of the world
  std::optional<double> console_temperature_C_;
  WorldInputs last_;  ///< inputs that truth_ was computed for
  Truth truth_;
  int cycle_ = 0;
  bool quit_ = false;
};

}  // namespace virtual_cell
