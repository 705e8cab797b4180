#include "firmware-like/plausibility_filter.h"

#include <algorithm>

#include "firmware-like/geometry/rotation.h"

namespace plumbline {
namespace {

bool Finite(const Pose& pose) {
  return pose.R.allFinite() && pose.p.allFinite();
}

/// Agreement of the reported tool pose with forward kinematics.
struct TcpAgreement {
  bool agrees = false;
  std::optional<int> tip_of{};  ///< the tool that it contradicts `mounted` with
};

TcpAgreement AgreementOf(const deflection::LoadedArm& arm, const model::RobotState& state,
                         const model::JointVector& q_before, std::optional<int> mounted,
                         const PlausibilityLimits& limits) {
  kinematics::Posture posture, before;
  arm.chain().Evaluate(state.q, posture);
  arm.chain().Evaluate(q_before, before);
  const Pose& X_BF = posture.X_BF();
  const auto agrees = [&](const Pose& X_FT) {
    const Pose X_BT = X_BF * X_FT;
    const Pose X_BT_before = before.X_BF() * X_FT;
    const double moved_m = (X_BT.p - X_BT_before.p).norm();
    const double turned_rad = VectorFromRotation(X_BT.R * X_BT_before.R.transpose()).norm();
    return (X_BT.p - state.X_BT->p).norm() <= limits.tcp_tolerance_m + 2 * moved_m &&
           VectorFromRotation(X_BT.R * state.X_BT->R.transpose()).norm() <=
               limits.tcp_tolerance_rad + 2 * turned_rad;
  };
  if (state.tcp_is_flange) return {agrees(Pose())};
  if (state.X_FT) return {agrees(*state.X_FT)};
  // The controller does not report its tool offset: assume that of the mounted tool, or none.
  if (mounted && agrees(arm.X_FT(*mounted))) return {true};
  if (agrees(Pose())) return {true};
  for (int tool = 0; tool < arm.tools(); ++tool) {
    if (!agrees(arm.X_FT(tool))) continue;
    return mounted ? TcpAgreement{false, tool} : TcpAgreement{true};
  }
  return {};
}

}  // namespace

const char* Describe(InputFault fault) {
  switch (fault) {
    case InputFault::kOk:
      return "ok";
    case InputFault::kMissing:
      return "no reading yet";
    case InputFault::kStale:
      return "stale";
    case InputFault::kNotFinite:
      return "not a number";
    case InputFault::kJointLimit:
      return "joint outside its limits";
    case InputFault::kJump:
      return "joint jumped";
    case InputFault::kJointCount:
      return "wrong number of joints";
    case InputFault::kTcpMismatch:
      return "reported tool pose contradicts the joints";
    case InputFault::kTooSmall:
      return "joint values too small to be readings";
    case InputFault::kAllZero:
      return "all joints exactly zero, and no tool pose confirms it";
  }
  return "?";
}

const char* RemedyOf(InputFault fault) {
  switch (fault) {
    case InputFault::kMissing:
    case InputFault::kStale:
      return "check the link, that the controller refreshes its registers, and the profile's "
             "[sequence]; a slow link or controller needs a larger robot.stale_after_ms";
    case InputFault::kNotFinite:
    case InputFault::kTooSmall:
      return "check addresses, type and word order of the profile's joints";
    case InputFault::kJointLimit:
      return "check min_deg and max_deg of the cell, and addresses, unit and word order of the "
             "profile's joints";
    case InputFault::kJointCount:
      return "check the profile against the cell";
    case InputFault::kTcpMismatch:
      return "check the profile's joint decoding, the tool offset and the cell's kinematics; "
             "plumbline identify-controller names the difference, such as an axis counted against "
             "the ground";
    case InputFault::kAllZero:
      return "move a joint; if they stay zero, check the addresses of the profile's joints, and "
             "that the robot is switched on and referenced";
    case InputFault::kJump:
    case InputFault::kOk:
      return "";
  }
  return "";
}

InputFault PlausibilityFilter::Check(const deflection::LoadedArm& arm,
                                     const model::RobotState& state, double now_s,
                                     std::optional<int> mounted) {
  if (state.sequence == 0) return InputFault::kMissing;
  if (state.sequence != sequence_) {
    sequence_ = state.sequence;
    const InputFault fault = CheckNewReading(arm, state, mounted);
    if (fault != InputFault::kOk) {
      fault_ = fault;
      good_in_a_row_ = 0;
    } else if (++good_in_a_row_ >= limits_.readings_to_trust) {
      fault_ = InputFault::kOk;
    }
  }
  if (now_s - state.timestamp_s > limits_.stale_after_s) {
    // Readings after a gap must regain trust.
    fault_ = InputFault::kStale;
    good_in_a_row_ = 0;
    have_last_ = false;
    seen_off_zero_ = false;  // the controller may have restarted
  }
  return fault_;
}

InputFault PlausibilityFilter::CheckNewReading(const deflection::LoadedArm& arm,
                                               const model::RobotState& state,
                                               std::optional<int> mounted) {
  if (state.q.size() != arm.size()) return InputFault::kJointCount;
  if (!state.q.allFinite() || (state.X_BT && !Finite(*state.X_BT)) ||
      (state.X_FT && !Finite(*state.X_FT))) {
    return InputFault::kNotFinite;
  }
  const auto size = state.q.array().abs();
  if ((size > 0 && size < limits_.least_magnitude).any()) return InputFault::kTooSmall;
  seen_off_zero_ = seen_off_zero_ || (size >= limits_.zero).any();
  if (!seen_off_zero_ && !state.X_BT) return InputFault::kAllZero;
  if (!arm.chain().WithinLimits(state.q, limits_.limit_margin_rad)) return InputFault::kJointLimit;
  const double elapsed_s =
      std::clamp(state.timestamp_s - changed_s_, 0.0, limits_.slowest_refresh_s);
  const double allowed = limits_.max_joint_step + limits_.max_joint_speed * elapsed_s;
  const bool jumped = have_last_ && (state.q - last_q_).cwiseAbs().maxCoeff() > allowed;
  const model::JointVector q_before = have_last_ ? last_q_ : state.q;
  if (!have_last_ || state.q != last_q_) changed_s_ = state.timestamp_s;
  last_q_ = state.q;
  have_last_ = true;
  if (jumped) return InputFault::kJump;
  if (state.X_BT) {
    const auto [agrees, tip_of] = AgreementOf(arm, state, q_before, mounted, limits_);
    tip_of_other_tool_ = tip_of;
    contradictions_in_a_row_ = agrees ? 0 : contradictions_in_a_row_ + 1;
    if (!agrees &&
        (!decoding_checked_ || contradictions_in_a_row_ >= limits_.readings_to_contradict)) {
      return InputFault::kTcpMismatch;
    }
    decoding_checked_ = decoding_checked_ || agrees;
  }
  return InputFault::kOk;
}

}  // namespace plumbline
