// The nominal robot controller: it believes in a rigid arm and a straight tool.
#pragma once

#include <cstddef>

#include "tests/virtual_cell/inverse_kinematics.h"
#include "tests/virtual_cell/motion_program.h"

namespace virtual_cell {

enum class MoveAnswer { kAccepted = 0, kUnreachable = 1, kOutsideLimits = 2 };

struct MotionLimits {
  double speed = 1.0;         ///< of the fastest joint [rad/s], [m/s]
  double acceleration = 2.0;  ///< [rad/s^2], [m/s^2]
};

/// Moves all joints together along a quintic in time, so that speed and acceleration are limited
/// and jerk is finite:  s(x) = 10 x^3 - 15 x^4 + 6 x^5,  x = t / T.
class Controller {
 public:
  Controller(CellDescription cell, const Joints& home, MotionLimits limits = {});

  MoveAnswer MoveToJoints(const Joints& q);
  MoveAnswer MoveToPose(const Motion& X_BT);
  void SetJoints(const Joints& q);  ///< at once: for replayed rows
  void Advance(double dt);
  bool Moving() const { return moving_; }

  void AttachPayload(double mass_kg) { payload_kg_ = mass_kg; }
  void ReleasePayload() { payload_kg_ = 0; }
  double payload_kg() const { return payload_kg_; }

  const Joints& q() const { return q_; }
  const Joints& speed() const { return speed_; }
  const Joints& last_move() const { return last_move_; }
  Motion NominalTipPose() const { return NominalTip(cell_, arm_, q_); }
  const CellDescription& cell() const { return cell_; }

 private:
  CellDescription cell_;
  Arm arm_;
  MotionLimits limits_;
  Joints q_, speed_, from_, to_, last_move_;
  bool moving_ = false;
  double elapsed_s_ = 0, duration_s_ = 0;
  double payload_kg_ = 0;
};

/// Steps through a motion program for ever, or to a named point, where it then stays.
class ProgramRunner {
 public:
  ProgramRunner(MotionProgram program, std::string hold_at);

  void Advance(double dt, Controller& controller);
  bool Holding() const { return holding_; }
  int rounds() const { return rounds_; }
  const MotionProgram& program() const { return program_; }

 private:
  void Start(const ProgramStep& step, Controller& controller);

  MotionProgram program_;
  std::string hold_at_;
  std::size_t next_ = 0;
  double waiting_s_ = 0;
  std::string reached_;  ///< point of the move under way
  bool holding_ = false;
  int rounds_ = 0;
};

}  // namespace virtual_cell
