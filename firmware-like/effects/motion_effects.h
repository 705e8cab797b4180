// Effects of the last move, and of moving while measuring.
#pragma once

#include "firmware-like/effects/contributions.h"

namespace plumbline::effects {

/// Incomplete approach: a joint that is measured before it has fully arrived.
/// s_i -= value_i (last move of joint i). Unit: 1, the fraction of the move that
/// remains. Valid if the waiting time after each move is the same.
struct ApproachLag {
  static EffectTraits Traits() {
    return {.id = "approach_lag",
            .meaning = "the joint is measured before it has fully arrived",
            .remedy = "wait longer after a move, or tighten the controller's in-position window",
            .formula = "s_i -= v_i (last move of joint i)",
            .shown_by = "moves of different length: the lag grows with the move",
            .parameters = {{"q#", "1", 1, {-0.005, 0.02}}},
            .needs = {Signal::kOrder},
            .confused_with = {"backlash", "latency", "gear_ratio"},
            .per_joint = true,
            .of_arm = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    AddToJoints<T>(Influence<T>::kTurn, term, values, influence,
                   [&](int joint) { return -OfJoint(conditions.last_move, joint); });
  }
};

/// Following error: a joint that lags its command in proportion to its speed in a synchronised
/// move. In a synchronised point-to-point move all joints start and arrive together, so joint i
/// runs at a fixed fraction of the leading joint's speed:
///   s_i -= value_i u_i,   u_i = dq_i / max_j |dq_j|                        [rad]
/// with dq the change of q in the last move. A position loop with gain K_v lags by qd / K_v
/// (Siciliano et al., Robotics, ch. 8). Whatever part of the lag is left when the point is measured
/// (not yet settled, or retained by static friction) is proportional to u_i. Unlike `approach_lag`
/// it does not grow with the move; unlike `backlash` by move it is smaller in a joint that turned
/// little. Valid for arms with joints of one type, moves at one programmed speed, and moves long
/// enough to reach it.
struct FollowingError {
  static EffectTraits Traits() {
    return {.id = "following_error",
            .meaning =
                "the joint stops short of its command in proportion to its speed in the last move",
            .remedy =
                "wait longer after a move, or increase the gain of the position loop; measure at "
                "production speed",
            .formula = "s_i -= v_i u_i, u_i = dq_i / max_j |dq_j| of the last move",
            .shown_by =
                "moves of different length, and moves in which the joint turns much less than "
                "another one: the error follows the share, not the length",
            .parameters = {{.name = "q#",
                            .unit = "rad",
                            .plausible = {-5e-3, 5e-3},
                            .prismatic_unit = "m",
                            .prismatic_plausible = {-5e-3, 5e-3}}},
            .needs = {Signal::kOrder},
            .confused_with = {"approach_lag", "backlash", "arrival_friction", "latency"},
            .per_joint = true,
            .of_arm = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    AddToJoints<T>(Influence<T>::kTurn, term, values, influence,
                   [&](int joint) { return -ShareOfMove(conditions, joint); });
  }
};

/// Arrival friction: load-dependent friction that stops a joint short of its command.
/// Coulomb friction in a loaded gear grows with the load, mu |tau|, and opposes the motion of the
/// arriving joint. It winds up the drive train until the controller considers the target reached:
///   s_i -= value_i u_i |tau_i|,   u_i = dq_i / max_j |dq_j|          [rad/(N m)]
/// with dq the last move and tau the gravity torque. The value is approximately the friction
/// coefficient times the compliance. Valid under the same conditions as `following_error`; this is
/// its load-dependent part.
struct ArrivalFriction {
  static EffectTraits Traits() {
    return {.id = "arrival_friction",
            .meaning = "friction that grows with the load holds the joint short of its command",
            .remedy =
                "approach from one side; check lubrication and preload if it grows; otherwise let "
                "the correction compensate for it",
            .formula = "s_i -= v_i u_i |tau_i|, u_i = dq_i / max_j |dq_j| of the last move",
            .shown_by =
                "arrivals from both sides in poses, or with payloads, of different torque on "
                "the joint",
            .sound_size =
                "as lost motion and hysteresis: below 6e-4 rad (2 arcmin) [Nabtesco RV "
                "catalogue; Harmonic Drive]",
            .parameters = {{.name = "q#",
                            .unit = "rad/(N m)",
                            .plausible = {-5e-5, 2e-4},
                            .prismatic_unit = "m/N",
                            .prismatic_plausible = {-5e-5, 2e-4}}},
            .needs = {Signal::kOrder, Signal::kTorques},
            .confused_with = {"following_error", "backlash", "approach_lag", "joint_compliance"},
            .per_joint = true,
            // As lost motion and hysteresis: 2 arcmin (backlash).
            .largest_observed_rotation_rad = 6e-4,
            .of_arm = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    AddToJoints<T>(Influence<T>::kLoadShare, term, values, influence,
                   [&](int joint) { return -ShareOfMove(conditions, joint); });
  }
};

/// Latency: joints and measurement that were not sampled at the same time.
/// s_i -= time qd_i, the same time for all joints: the measurement shows the arm
/// where it was `time` ago. Unit: s. Adds nothing if velocities are unknown. Valid if qd hardly
/// changes within `time`.
struct Latency {
  static EffectTraits Traits() {
    return {.id = "latency",
            .meaning = "the arm is measured at another time than its joints are read",
            .remedy = "synchronise instrument and controller, or measure at standstill",
            .formula = "s_i -= time qd_i, one time for all joints",
            .shown_by = "measurements while moving, at different speeds and in both directions",
            .sound_size = "0 at standstill",
            .parameters = {{"time", "s", 1, {-0.2, 0.5}}},
            .needs = {Signal::kVelocity},
            .confused_with = {"approach_lag", "backlash", "dynamic_inertia"}};
  }

  template <typename T>
  static void Add(const EffectTerm&, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    for (const T& time_s : values) {
      for (int joint = 0; joint < conditions.qd.size(); ++joint) {
        influence.Joint(Influence<T>::kTurn, joint) -= time_s * conditions.qd[joint];
      }
    }
  }
};

/// Dynamic deflection: a joint that lags while it is accelerated.
/// s_i -= value_i qdd_i, value_i = compliance times inertia = 1 / (natural frequency)^2
/// [Spong 1987, J. Dyn. Syst. Meas. Control 109(4)]. Unit: s^2. Adds nothing if
/// accelerations are unknown. Valid far below the joint's natural frequency and for a nearly
/// constant inertia.
struct DynamicInertia {
  static EffectTraits Traits() {
    return {.id = "dynamic_inertia",
            .meaning = "the joint winds up under the inertia of what it accelerates",
            .remedy = "measure at standstill, or lower the acceleration near the point",
            .formula = "s_i -= v_i qdd_i",
            .shown_by = "measurements while accelerating and while braking",
            .sound_size =
                "1 / (2 pi f)^2: 2.5e-4 s^2 for a natural frequency f of 10 Hz; 0 at standstill",
            .parameters = {{"q#", "s^2", 1, {0, 3e-3}}},
            .needs = {Signal::kAcceleration},
            .confused_with = {"latency", "joint_compliance", "approach_lag"},
            .per_joint = true,
            .of_arm = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    AddToJoints<T>(Influence<T>::kTurn, term, values, influence,
                   [&](int joint) { return -OfJoint(conditions.qdd, joint); });
  }
};

}  // namespace plumbline::effects
