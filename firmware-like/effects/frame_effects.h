// Effects on the frames: base, tool tip, direction of gravity, and what displaces them.
#pragma once

#include "firmware-like/effects/contributions.h"

namespace plumbline::effects {

/// Base frame error: a robot base that is not where it was declared in the measurement frame.
/// The base moves by (x, y, z) in W, and (roll, pitch, yaw) are added to its declared angles:
///   X_WB = (R = Rz(yaw) Ry(pitch) Rx(roll), p = p_WB + (x, y, z))
/// Gravity is fixed in W, so a rotated base also changes the joint loads. It is a nuisance
/// parameter if the cell declares the measurement frame as unaligned, and an effect if aligned.
/// File units: mm, deg. Valid away from pitch = 90 deg.
struct BaseFrame : AddsFrom<Entries::kBase> {
  static EffectTraits Traits() {
    return {
        .id = "base_frame",
        .meaning = "the robot's base is not where it was declared",
        .remedy = "align the instrument to the base again, or correct base_xyz_mm and base_rpy_deg",
        .formula =
            "p_WB += (x, y, z); roll, pitch and yaw are added to the declared angles of the"
            " base",
        .shown_by =
            "poses on all sides of the base. With frame = \"unaligned\" it is not an effect"
            " but estimated in every fit",
        .parameters = {{"x", "mm", 1e-3, {-20, 20}},
                       {"y", "mm", 1e-3, {-20, 20}},
                       {"z", "mm", 1e-3, {-20, 20}},
                       {"roll", "deg", kRadPerDeg, {-2, 2}},
                       {"pitch", "deg", kRadPerDeg, {-2, 2}},
                       {"yaw", "deg", kRadPerDeg, {-2, 2}}},
        .needs = {},
        .confused_with = {"joint_offset", "link_geometry", "gravity_direction",
                          "pedestal_compliance", "thermal_drift", "step_event", "tool_frame"},
        .nuisance = Nuisance::kBaseFrame};
  }
};

/// Tool frame error: a tip that is not where it was declared on the flange.
/// The tip moves by (x, y, z) in F, in addition to the bending. It is a nuisance parameter if the
/// cell declares the tool as unknown, and an effect if known. File unit: mm. Only the tip moves;
/// masses and the bending of the tool stay as declared.
struct ToolFrame : AddsFrom<Entries::kTip> {
  static EffectTraits Traits() {
    return {.id = "tool_frame",
            .meaning = "the tool tip is not where it was declared on the flange",
            .remedy =
                "calibrate the tool centre point again, and check for a bent or badly seated tool",
            .formula = "p_FT += (x, y, z)",
            .shown_by =
                "different orientations of the tool. With tool = \"unknown\" it is not an "
                "effect but estimated in every fit",
            .parameters = {{"x", "mm", 1e-3, {-10, 10}},
                           {"y", "mm", 1e-3, {-10, 10}},
                           {"z", "mm", 1e-3, {-10, 10}}},
            .needs = {},
            .confused_with = {"joint_offset", "link_geometry", "payload_cog", "step_event",
                              "base_frame"},
            .nuisance = Nuisance::kToolFrame};
  }
};

/// Gravity direction: a measurement frame that is not level.
/// Gravity rotates about the axes of the measurement frame by the rotation vector (x, y, 0). Unit:
/// rad. The instrument, or the frame built from its reference marks, was not levelled; only loads
/// change, not the geometry.
struct GravityDirection : AddsFrom<Entries::kGravityTurnX> {
  static EffectTraits Traits() {
    return {.id = "gravity_direction",
            .meaning = "the measurement frame is not level",
            .remedy = "level the instrument, or enter gravity_m_s2 in the measurement frame",
            .formula = "g is rotated by the rotation vector (x, y, 0) about the axes of W",
            .shown_by =
                "several payloads on all sides of the base: only loads change, not the geometry",
            .parameters = {{"x", "rad", 1, {-0.035, 0.035}}, {"y", "rad", 1, {-0.035, 0.035}}},
            .needs = {},
            .confused_with = {"base_frame", "pedestal_compliance", "payload_mass", "payload_cog"}};
  }
};

/// Base tilt: the base rotates by a factor times the reading of its inclinometer.
/// The base rotates about its origin by value times the inclinometer reading, columns tilt_x_deg
/// and tilt_y_deg: rotations about x and y of W. Unit: 1; the value is 1 if the base rotates
/// exactly by the reading. Gravity keeps its direction in W. Valid for rotations of milliradians.
/// Adds nothing if the columns are missing.
struct BaseTilt {
  static EffectTraits Traits() {
    return {.id = "base_tilt",
            .meaning = "the base tilts as its inclinometer reads",
            .remedy =
                "find out what tilts it: the floor, the anchor bolts, a press beside it; with a "
                "permanent inclinometer, let the correction compensate for it",
            .formula = "the base is rotated by gain (tilt_x_deg, tilt_y_deg) about the axes of W",
            .shown_by = "an inclinometer on the base whose readings vary",
            .sound_size = "gain 1 if the base follows its inclinometer",
            .parameters = {{"gain", "1", 1, {-2, 2}}},
            .needs = {Signal::kTilt},
            .confused_with = {"tilt_event", "thermal_drift", "pedestal_compliance", "base_frame"}};
  }

  template <typename T>
  static void Add(const EffectTerm&, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    const auto about_x = conditions.Signal("tilt_x_deg"), about_y = conditions.Signal("tilt_y_deg");
    if (!about_x || !about_y) return;
    for (const T& gain : values) {
      influence[Influence<T>::kBaseTilt] += gain * (*about_x * kRadPerDeg);
      influence[Influence<T>::kBaseTilt + 1] += gain * (*about_y * kRadPerDeg);
    }
  }
};

/// Step event: sudden displacement of the base or the tip after a slip, a collision or an exchange.
/// From the event onwards (t_s >= time, or row number >= row, counted from 1), the base in W (frame
/// = base) or the tip in F (frame = tool) is displaced by (x, y, z). File units: s, 1, mm. Adds
/// nothing if no event time is given or its signal is unknown. The event time has no derivative and
/// must be found by search.
struct StepEvent {
  enum Parameter { kTime, kRow, kX };

  static EffectTraits Traits() {
    return {
        .id = "step_event",
        .meaning = "something moved at one time: a slip, a collision, an exchanged tool",
        .remedy =
            "find out what happened at that time; fasten the part, and align or calibrate again",
        .formula = "from the moment on, the base or the tip is displaced by (x, y, z)",
        .shown_by = "the same few poses repeated before and after the moment",
        .parameters = {{"time", "s", 1, {0, 1e7}, ParameterRole::kShape},
                       {"row", "1", 1, {1, 1e6}, ParameterRole::kShape},
                       {"x", "mm", 1e-3, {-10, 10}},
                       {"y", "mm", 1e-3, {-10, 10}},
                       {"z", "mm", 1e-3, {-10, 10}},
                       {.name = "frame", .role = ParameterRole::kWord, .words = "base,tool"}},
        .needs = {},
        .confused_with = {"thermal_drift", "base_frame", "tool_frame", "thermal_growth",
                          "tilt_event"},
        .name = "a step at one time"};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    if (!HasHappened(term, values, conditions)) return;
    const int first = term.word == "tool" ? Influence<T>::kTip : Influence<T>::kBase;
    for (std::size_t k = 0; k < values.size(); ++k) {
      const int spec = term.parameters[k].spec;
      if (spec >= kX) influence[first + spec - kX] += values[k];
    }
  }
};

/// Tilt event: a base that tilted suddenly.
/// From the event onwards (t_s >= time, or row number >= row, counted from 1), the base is rotated
/// about its origin by x about the x axis and y about the y axis of W. Typical causes: slipped
/// anchor bolts, a settled floor, a new session on a mobile platform. File units: s, 1, deg. Adds
/// nothing if no event time is given or its signal is unknown. Valid for rotations of milliradians.
/// The event time has no derivative and must be found by search.
struct TiltEvent {
  enum Parameter { kTime, kRow, kX };

  static EffectTraits Traits() {
    return {
        .id = "tilt_event",
        .meaning = "the base tilted at one time: its bolts slipped, or the floor settled",
        .remedy = "find out what happened at that time; fasten the base, and align again",
        .formula = "from the moment on, the base is rotated by x and y about the axes of W",
        .shown_by = "the same poses on all sides of the base repeated before and after the moment",
        .parameters = {{"time", "s", 1, {0, 1e7}, ParameterRole::kShape},
                       {"row", "1", 1, {1, 1e6}, ParameterRole::kShape},
                       {"x", "deg", kRadPerDeg, {-1, 1}},
                       {"y", "deg", kRadPerDeg, {-1, 1}}},
        .needs = {},
        .confused_with = {"step_event", "thermal_drift", "base_tilt", "base_frame"},
        .name = "a tilt at one time"};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    if (!HasHappened(term, values, conditions)) return;
    for (std::size_t k = 0; k < values.size(); ++k) {
      const int spec = term.parameters[k].spec;
      if (spec >= kX) influence[Influence<T>::kBaseTilt + spec - kX] += values[k];
    }
  }
};

/// Thermal drift: a base or instrument that drifts while the cell warms up.
/// The base moves by (x, y, z) (1 - exp(-t / time_constant)) in W, with t the time of the row [s].
/// File units: mm, s. Adds nothing without a time constant, or if the time is unknown. Valid for
/// one warm-up that started at t = 0. A body of small and one of large heat capacity warm up with
/// two time constants [lumped capacities: Incropera & DeWitt, ch. 5]: two effects, which add.
struct ThermalDrift {
  static constexpr int kTimeConstant = 3;

  static EffectTraits Traits() {
    return {.id = "thermal_drift",
            .meaning = "the base, or the instrument, moves as the cell warms up",
            .remedy = "warm up the cell before work, or measure a fixed reference between parts",
            .formula = "p_WB += (x, y, z) (1 - exp(-t / time_constant))",
            .shown_by = "the same few poses repeated from the cold start to the end of the warm-up",
            .parameters = {{"x", "mm", 1e-3, {-3, 3}},
                           {"y", "mm", 1e-3, {-3, 3}},
                           {"z", "mm", 1e-3, {-3, 3}},
                           {"time_constant", "s", 1, {10, 1e6}, ParameterRole::kShape}},
            .needs = {Signal::kTime},
            .confused_with = {"thermal_growth", "step_event", "base_frame"}};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    if (!conditions.t_s) return;
    using std::exp;
    T warmth(0);
    for (std::size_t k = 0; k < values.size(); ++k) {
      if (term.parameters[k].spec == kTimeConstant)
        warmth = 1.0 - exp(-*conditions.t_s / values[k]);
    }
    for (std::size_t k = 0; k < values.size(); ++k) {
      const int axis = term.parameters[k].spec;
      if (axis != kTimeConstant) influence[Influence<T>::kBase + axis] += values[k] * warmth;
    }
  }
};

}  // namespace plumbline::effects
