#include "tests/virtual_cell/controller.h"

#include <algorithm>
#include <cmath>

namespace virtual_cell {

Controller::Controller(CellDescription cell, const Joints& home, MotionLimits limits)
    : cell_(std::move(cell)), arm_(ArmFromDescription(cell_)), limits_(limits), q_(home) {
  speed_ = Joints::Zero(q_.size());
  from_ = to_ = q_;
  last_move_ = Joints::Zero(q_.size());
}

MoveAnswer Controller::MoveToJoints(const Joints& q) {
  if (q.size() != q_.size() || !q.allFinite()) return MoveAnswer::kUnreachable;
  for (int i = 0; i < cell_.size(); ++i) {
    const JointDescription& joint = cell_.joints[static_cast<std::size_t>(i)];
    if (q[i] < joint.min || q[i] > joint.max) return MoveAnswer::kOutsideLimits;
  }
  from_ = q_;
  to_ = q;
  const double way = (to_ - from_).cwiseAbs().maxCoeff();
  if (way > 0) last_move_ = to_ - from_;
  // Maximum speed of the quintic: 15/8 distance/T; maximum acceleration: 10/sqrt(3) distance/T^2.
  duration_s_ = std::max(15.0 / 8 * way / limits_.speed,
                         std::sqrt(10 / std::sqrt(3.0) * way / limits_.acceleration));
  elapsed_s_ = 0;
  moving_ = true;
  return MoveAnswer::kAccepted;
}

MoveAnswer Controller::MoveToPose(const Motion& X_BT) {
  if (!X_BT.matrix().allFinite()) return MoveAnswer::kUnreachable;
  const std::optional<Joints> q = SolveInverseKinematics(cell_, arm_, X_BT, q_);
  return q ? MoveToJoints(*q) : MoveAnswer::kUnreachable;
}

void Controller::SetJoints(const Joints& q) {
  if (q != q_) last_move_ = q - q_;
  q_ = from_ = to_ = q;
  moving_ = false;
}

void Controller::Advance(double dt) {
  if (!moving_) {
    speed_.setZero();
    return;
  }
  elapsed_s_ += dt;
  if (elapsed_s_ >= duration_s_) {
    q_ = to_;
    speed_.setZero();
    moving_ = false;
    return;
  }
  const double x = elapsed_s_ / duration_s_;
  q_ = from_ + (to_ - from_) * (x * x * x * (10 + x * (6 * x - 15)));
  speed_ = (to_ - from_) * (30 * x * x * (1 - x) * (1 - x) / duration_s_);
}

ProgramRunner::ProgramRunner(MotionProgram program, std::string hold_at)
    : program_(std::move(program)), hold_at_(std::move(hold_at)) {}

void ProgramRunner::Start(const ProgramStep& step, Controller& controller) {
  reached_.clear();
  switch (step.kind) {
    case ProgramStep::Kind::kHome:
      controller.MoveToJoints(program_.home);
      break;
    case ProgramStep::Kind::kJoints:
      controller.MoveToJoints(step.joints);
      break;
    case ProgramStep::Kind::kMove:
      if (controller.MoveToPose(program_.Find(step.point)->TipInBase()) == MoveAnswer::kAccepted) {
        reached_ = step.point;
      }
      break;
    case ProgramStep::Kind::kAttach:
      controller.AttachPayload(program_.payload_kg);
      break;
    case ProgramStep::Kind::kRelease:
      controller.ReleasePayload();
      break;
    case ProgramStep::Kind::kWait:
      waiting_s_ = step.wait_s;
      break;
  }
}

void ProgramRunner::Advance(double dt, Controller& controller) {
  if (holding_ || program_.steps.empty() || controller.Moving()) return;
  if (!hold_at_.empty() && reached_ == hold_at_) {
    holding_ = true;
    return;
  }
  waiting_s_ -= dt;
  if (waiting_s_ > 0) return;
  Start(program_.steps[next_], controller);
  next_ = (next_ + 1) % program_.steps.size();
  if (next_ == 0) ++rounds_;
}

}  // namespace virtual_cell
