// Nominal robot controller, which assumes a rigid arm and a straight tool.
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

/// Moves all joints synchronously along a quintic in time, with limited speed and acceleration
/// and jerk is finite:  s(x) = 10 x^3 - 15 x^4 + 6 x^5,  x = t / T.
class Controller {
 public:
  Controller(CellDescription cell, const Joints& home, MotionLimits limits = {});

  MoveAnswer MoveToJoints(const Joints& q);
  MoveAnswer MoveToPose(const Motion& X_BT);
  void SetJoints(const Joints& q);  ///< immediately, for replayed rows
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

/// Executes a motion program repeatedly, or up to a named point where it holds.
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
  std::string reached_;  ///< target point of the present move
  bool holding_ = false;
  int rounds_ = 0;
};

}  // namespace virtual_cell
